// The rectangle [x, x + width] × [y, y + height], turned about the origin by `turn` degrees.
//
//     +- northwest -+---- north ----+        `northwest` and `southwest` are there where `top`
//     |                             |        and `split` are above 0: their lengths.
//   west           body            east
//     |                             |
//     +- southwest -+---- south ----+
DefineConstant[ size = {0.1, Name "Parameters/size"}, width = 1, height = 1, x = 0, y = 0, turn = 0, split = 0, top = 0 ];
c = Cos(turn * Pi / 180);
s = Sin(turn * Pi / 180);
px[] = {x, x + split, x + width, x + width, x + top, x};
py[] = {y, y, y, y + height, y + height, y + height};
For k In {0:5}
  Point(k + 1) = {c * px[k] - s * py[k], s * px[k] + c * py[k], 0};
EndFor
first = split > 0 ? 2 : 1;
last = top > 0 ? 5 : 6;
Line(1) = {first, 3};
Line(2) = {3, 4};
Line(3) = {4, last};
Line(4) = {6, 1};
sides[] = {1, 2, 3};
If (top > 0)
  Line(5) = {5, 6};
  sides[] += {5};
  Physical Curve("northwest") = {5};
EndIf
sides[] += {4};
If (split > 0)
  Line(6) = {1, 2};
  sides[] += {6};
  Physical Curve("southwest") = {6};
EndIf
Curve Loop(1) = {sides[]};
Plane Surface(1) = {1};
Physical Surface("body") = {1};
Physical Curve("south") = {1};
Physical Curve("east") = {2};
Physical Curve("north") = {3};
Physical Curve("west") = {4};
Mesh.MeshSizeMax = size;
