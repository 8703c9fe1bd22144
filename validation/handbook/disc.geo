// A quarter of a disc of radius 1: sides first (y = 0), outer, last (x = 0).
DefineConstant[ size = {0.2, Name "Parameters/size"} ];
Point(1) = {0, 0, 0};
Point(2) = {1, 0, 0};
Point(3) = {0, 1, 0};
Line(1) = {1, 2};
Circle(2) = {2, 1, 3};
Line(3) = {3, 1};
Curve Loop(1) = {1, 2, 3};
Plane Surface(1) = {1};
Physical Surface("body") = {1};
Physical Curve("first") = {1};
Physical Curve("outer") = {2};
Physical Curve("last") = {3};
Mesh.MeshSizeMax = size;
