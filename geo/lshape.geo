// L-shaped body of Example II: a leg with a long arm, clamped at the foot.
//
//   (0,6) ------------- load ------------- (8,6)
//     |                                      |
//     |                 body                 |     in metres
//     |        (2,4) --- (6,4) foundation (8,4)
//     |          |
//     |          |
//   (0,0) clamp (2,0)
//
// size     edge length in m
// grading  edges are size/grading long at the re-entrant corner (2,4) and at the ends
//          of the contact, (6,4) and (8,4), and of the clamp, (0,0) and (2,0);
//          they grow by a quarter of the distance until they reach `size`.

DefineConstant[
  size = {0.25, Name "Parameters/size"},
  grading = {1, Name "Parameters/grading"}
];

Point(1) = {0, 0, 0};
Point(2) = {2, 0, 0};
Point(3) = {2, 4, 0};
Point(4) = {6, 4, 0};
Point(5) = {8, 4, 0};
Point(6) = {8, 6, 0};
Point(7) = {0, 6, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 1};
Curve Loop(1) = {1 : 7};
Plane Surface(1) = {1};

Field[1] = MathEval;
Field[1].F = Sprintf("%.16g", size);
singular[] = {3, 4, 5, 1, 2};
For i In {0 : #singular[] - 1}
  p[] = Point{singular[i]};
  Field[2 + i] = MathEval;
  Field[2 + i].F = Sprintf("%.16g + 0.25 * sqrt((x - %.16g)^2 + (y - %.16g)^2)", size / grading, p[0], p[1]);
EndFor
Field[10] = Min;
Field[10].FieldsList = {1 : 1 + #singular[]};
Background Field = 10;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;

Physical Surface("body") = {1};
Physical Curve("clamp") = {1};
Physical Curve("foundation") = {4};
Physical Curve("load") = {6};
