// Simplified masonry bridge of Example III, whole: it stands on its two feet only.
//
//   (0,6) ------- (4,6) load (8,6) ------- (12,6)
//     |                                       |
//     |      (2,4) ------------- (10,4)       |     in metres
//     |        |                    |         |
//   (0,0) -- (2,0)               (10,0) -- (12,0)
//      foundation                   foundation
//
// size     edge length in m
// grading  edges are size/grading long at the re-entrant corners (2,4), (10,4) and at
//          the ends of the feet; they grow by a quarter of the distance up to `size`.
//
// The right half is meshed as the exact mirror image of the left about x = 6, and the
// left is the mesh of bridge-half.geo: change the geometry in both files alike.

DefineConstant[
  size = {0.25, Name "Parameters/size"},
  grading = {1, Name "Parameters/grading"}
];

// Only OpenCASCADE projects the copied nodes to round-off.
SetFactory("OpenCASCADE");
Point(1) = {0, 0, 0};
Point(2) = {2, 0, 0};
Point(3) = {2, 4, 0};
Point(4) = {6, 4, 0};
Point(5) = {6, 6, 0};
Point(6) = {4, 6, 0};
Point(7) = {0, 6, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7};
Plane Surface(1) = {1};

// The right half: the mirror image of each point and line is numbered ten higher.
Point(11) = {12, 0, 0};
Point(12) = {10, 0, 0};
Point(13) = {10, 4, 0};
Point(16) = {8, 6, 0};
Point(17) = {12, 6, 0};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 4};
Line(15) = {5, 16};
Line(16) = {16, 17};
Line(17) = {17, 11};
Curve Loop(2) = {11, 12, 13, 4, 15, 16, 17};
Plane Surface(2) = {2};
Periodic Surface {2} = {1} Affine {-1, 0, 0, 12,  0, 1, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1};

Field[1] = MathEval;
Field[1].F = Sprintf("%.16g", size);
sx[] = {2, 0, 2};
sy[] = {4, 0, 0};
For i In {0 : 2}
  Field[2 + i] = MathEval;
  Field[2 + i].F = Sprintf("%.16g + 0.25 * sqrt((x - %.16g)^2 + (y - %.16g)^2)", size / grading, sx[i], sy[i]);
EndFor
Field[10] = Min;
Field[10].FieldsList = {1 : 4};
Background Field = 10;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;

Physical Surface("body") = {1, 2};
Physical Curve("foundation") = {1, 11};
Physical Curve("load") = {5, 15};
