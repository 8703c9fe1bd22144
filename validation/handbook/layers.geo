// Two layers, `lower` of height `low` and `upper` of height `high`, each with points of its own. `joined = 1` makes them one
// body (Coherence); with 0 the nodes on their common side are double.
//
//     +--- north ---+
//    nw    upper    ne
//     +-------------+
//   west   lower   east
//     +--- south ---+
DefineConstant[ size = {0.1, Name "Parameters/size"}, width = 1, low = 0.5, high = 0.5, joined = 1 ];
For k In {0:1}
  y = k * low;
  h = k == 0 ? low : high;
  Point(4 * k + 1) = {0, y, 0};
  Point(4 * k + 2) = {width, y, 0};
  Point(4 * k + 3) = {width, y + h, 0};
  Point(4 * k + 4) = {0, y + h, 0};
  Line(4 * k + 1) = {4 * k + 1, 4 * k + 2};
  Line(4 * k + 2) = {4 * k + 2, 4 * k + 3};
  Line(4 * k + 3) = {4 * k + 3, 4 * k + 4};
  Line(4 * k + 4) = {4 * k + 4, 4 * k + 1};
  Curve Loop(k + 1) = {4 * k + 1, 4 * k + 2, 4 * k + 3, 4 * k + 4};
  Plane Surface(k + 1) = {k + 1};
EndFor
If (joined)
  Coherence;
EndIf
Physical Surface("lower") = {1};
Physical Surface("upper") = {2};
Physical Curve("south") = {1};
Physical Curve("east") = {2, 6};
Physical Curve("west") = {4, 8};
Physical Curve("north") = {7};
Mesh.MeshSizeMax = size;
