// Hertz line contact: right half of a half-disc on the rigid plane y = 0.
//
//   (0,R) ---- top ---- (R,R)
//     |                  /
//    axis    body       /  side          R = 50 mm, centre (0,R); `foundation` is the
//     |               _/                 arc from the lowest point up to 30 degrees
//   (0,0) _foundation-
//
// size     edge length far from the contact, in m
// grading  edges are size/grading long within 8 mm of the lowest point (default 25:
//          0.16 mm; for sizes from 10 mm on 1, where an adapted mesh begins), then grow
//          by a fifth of the distance until they reach `size`.

DefineConstant[
  size = {0.004, Name "Parameters/size"},
  grading = {size < 0.01 ? 25 : 1, Name "Parameters/grading"}
];
radius = 0.05;
zone = 0.008;

Point(1) = {0, 0, 0};
Point(2) = {radius * Sin(Pi / 6), radius * (1 - Cos(Pi / 6)), 0};
Point(3) = {radius, radius, 0};
Point(4) = {0, radius, 0};
Circle(1) = {1, 4, 2};
Circle(2) = {2, 4, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};

Field[1] = MathEval;
Field[1].F = Sprintf("%.16g", size);
Field[2] = MathEval;
Field[2].F = Sprintf("%.16g", size / grading);
Field[3] = MathEval;
Field[3].F = Sprintf("%.16g + 0.2 * (sqrt(x^2 + y^2) - %.16g)", size / grading, zone);
Field[4] = Max;
Field[4].FieldsList = {2, 3};
Field[5] = Min;
Field[5].FieldsList = {1, 4};
Background Field = 5;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;

Physical Surface("body") = {1};
Physical Curve("foundation") = {1};
Physical Curve("side") = {2};
Physical Curve("top") = {3};
Physical Curve("axis") = {4};
