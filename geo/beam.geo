// Slender beam clamped at both ends, over a foundation along its whole underside.
//
//   (0,0.5) ----------------- load ----------------- (8,0.5)
//   clamp                     body                     clamp     in metres
//   (0,0) ----------------- foundation ----------------- (8,0)
//
// size     edge length in m
// grading  edges are size/grading long at the four corners, where the clamps end; they
//          grow by a quarter of the distance until they reach `size`.

DefineConstant[
  size = {0.0625, Name "Parameters/size"},
  grading = {1, Name "Parameters/grading"}
];
span = 8;
depth = 0.5;

Point(1) = {0, 0, 0};
Point(2) = {span, 0, 0};
Point(3) = {span, depth, 0};
Point(4) = {0, depth, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1 : 4};
Plane Surface(1) = {1};

Field[1] = MathEval;
Field[1].F = Sprintf("%.16g", size);
For i In {1 : 4}
  p[] = Point{i};
  Field[1 + i] = MathEval;
  Field[1 + i].F = Sprintf("%.16g + 0.25 * sqrt((x - %.16g)^2 + (y - %.16g)^2)", size / grading, p[0], p[1]);
EndFor
Field[10] = Min;
Field[10].FieldsList = {1 : 5};
Background Field = 10;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;

Physical Surface("body") = {1};
Physical Curve("clamp") = {2, 4};
Physical Curve("foundation") = {1};
Physical Curve("load") = {3};
