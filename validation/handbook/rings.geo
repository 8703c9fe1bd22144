// A quarter of two rings, `core` from 1 to 1.5 and `rim` from 1.5 to 2.
DefineConstant[ size = {0.2, Name "Parameters/size"} ];
Point(1) = {0, 0, 0};
For k In {0:2}
  r = 1 + 0.5 * k;
  Point(2 + 2 * k) = {r, 0, 0};
  Point(3 + 2 * k) = {0, r, 0};
  Circle(1 + k) = {2 + 2 * k, 1, 3 + 2 * k};
EndFor
For k In {0:1}
  Line(11 + k) = {2 + 2 * k, 4 + 2 * k};
  Line(21 + k) = {5 + 2 * k, 3 + 2 * k};
  Curve Loop(1 + k) = {11 + k, 2 + k, 21 + k, -(1 + k)};
  Plane Surface(1 + k) = {1 + k};
EndFor
Physical Surface("core") = {1};
Physical Surface("rim") = {2};
Physical Curve("inner") = {1};
Physical Curve("outer") = {3};
Physical Curve("first") = {11, 12};
Physical Curve("last") = {21, 22};
Mesh.MeshSizeMax = size;
