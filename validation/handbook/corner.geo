// The upper half of an L: its re-entrant corner is (0, 0), its bisector the x axis, its arms have the width 1.
DefineConstant[ size = {0.25, Name "Parameters/size"} ];
Point(1) = {0, 0, 0};
Point(2) = {Sqrt(2), 0, 0};
Point(3) = {0, Sqrt(2), 0};
Point(4) = {-Sqrt(0.5), Sqrt(0.5), 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Physical Surface("body") = {1};
Physical Curve("axis") = {1};
Physical Curve("right") = {2};
Physical Curve("left") = {3};
Physical Curve("free") = {4};
Mesh.MeshSizeMax = size;
