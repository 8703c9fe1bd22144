// The unit square whose east side is in two physical curves, `load` and `east`; `west` is given in two lines, with a point that is
// a group of its own. With `clockwise = 1` loop, lines and triangles run the other way.
DefineConstant[ size = {0.25, Name "Parameters/size"}, clockwise = 0 ];
Point(1) = {0, 0, 0};
Point(2) = {1, 0, 0};
Point(3) = {1, 1, 0};
Point(4) = {0, 1, 0};
Point(5) = {0, 0.5, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
If (clockwise)
  Curve Loop(1) = {-5, -4, -3, -2, -1};
Else
  Curve Loop(1) = {1, 2, 3, 4, 5};
EndIf
Plane Surface(1) = {1};
Physical Point("corner") = {1};
Physical Curve("load") = {clockwise ? -2 : 2, 3};
Physical Curve("east") = {2};
Physical Curve("west") = {4};
Physical Curve("west") += {5};
Physical Curve("south") = {1};
Physical Surface("body") = {1};
Mesh.MeshSizeMax = size;
