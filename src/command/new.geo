// A block on a foundation: a rectangle, lengths in m.
// A scene can set these constants: `size` by mesh.size, the others by mesh.parameters.
DefineConstant[ size = 0.1, width = 2, height = 1 ];

Point(1) = {0, 0, 0, size};
Point(2) = {width, 0, 0, size};
Point(3) = {width, height, 0, size};
Point(4) = {0, height, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};

// The names by which the scene knows the boundary. What it does not name is free.
Physical Curve("base") = {1};
Physical Curve("top") = {3};
Physical Curve("left") = {4};
Physical Surface("body") = {1};
