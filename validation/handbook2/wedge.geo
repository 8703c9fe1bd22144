// A wedge with its tip at (0, 0): r <= radius, from <= θ <= to (degrees). Sides: first (θ = from), outer, last (θ = to).
DefineConstant[ size = {0.2, Name "Parameters/size"}, radius = 1, from = 0, to = 60 ];
Point(1) = {0, 0, 0};
For k In {0:2}
  angle = (from + (to - from) * k / 2) * Pi / 180;
  Point(2 + k) = {radius * Cos(angle), radius * Sin(angle), 0};
EndFor
Line(1) = {1, 2};
Circle(2) = {2, 1, 3};
Circle(3) = {3, 1, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Physical Surface("body") = {1};
Physical Curve("first") = {1};
Physical Curve("outer") = {2, 3};
Physical Curve("last") = {4};
Mesh.MeshSizeMax = size;
