// Part of a ring: inner <= r <= outer, from <= θ <= to (degrees). Sides: inner, outer, first (θ = from), last (θ = to).
DefineConstant[ size = {0.1, Name "Parameters/size"}, inner = 1, outer = 2, from = 0, to = 90 ];
Point(1) = {0, 0, 0};
For k In {0:2}
  angle = (from + (to - from) * k / 2) * Pi / 180;
  Point(2 + k) = {inner * Cos(angle), inner * Sin(angle), 0};
  Point(5 + k) = {outer * Cos(angle), outer * Sin(angle), 0};
EndFor
Circle(1) = {2, 1, 3};
Circle(2) = {3, 1, 4};
Circle(3) = {5, 1, 6};
Circle(4) = {6, 1, 7};
Line(5) = {2, 5};
Line(6) = {4, 7};
Curve Loop(1) = {5, 3, 4, -6, -2, -1};
Plane Surface(1) = {1};
Physical Surface("body") = {1};
Physical Curve("inner") = {1, 2};
Physical Curve("outer") = {3, 4};
Physical Curve("first") = {5};
Physical Curve("last") = {6};
Mesh.MeshSizeMax = size;
