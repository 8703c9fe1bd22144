// `count` vertical stripes s1, s2, … of the same `width`, joined side by side.
//
//     +-------- north --------+
//   west  s1  |  s2  |  …   east
//     +-------- south --------+
DefineConstant[ size = {0.1, Name "Parameters/size"}, width = 1, height = 1, count = 2, turn = 0 ];
c = Cos(turn * Pi / 180);
s = Sin(turn * Pi / 180);
For k In {0:count}
  Point(2 * k + 1) = {c * k * width, s * k * width, 0};
  Point(2 * k + 2) = {c * k * width - s * height, s * k * width + c * height, 0};
  Line(100 + k) = {2 * k + 1, 2 * k + 2};
EndFor
For k In {1:count}
  Line(200 + k) = {2 * k - 1, 2 * k + 1};
  Line(300 + k) = {2 * k + 2, 2 * k};
  Curve Loop(k) = {200 + k, 100 + k, 300 + k, -(99 + k)};
  Plane Surface(k) = {k};
  Physical Surface(Sprintf("s%g", k)) = {k};
EndFor
Physical Curve("south") = {201 : 200 + count};
Physical Curve("north") = {301 : 300 + count};
Physical Curve("west") = {100};
Physical Curve("east") = {100 + count};
Mesh.MeshSizeMax = size;
