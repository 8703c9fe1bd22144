// Unit square, structured: the body of Example I and of the convergence studies.
//
//   (0,1) ---- top ---- (1,1)
//     |                   |
//   left      body      right      in metres; Example I clamps `left`
//     |                   |        and presses `bottom` on the foundation
//   (0,0) -- bottom --- (1,0)
//
// size      edge length in m; only sets the default of n
// n         cells per side
// diagonal  0 right (/), 1 left (\), 2 alternating
// grading   1: uniform. Otherwise the grid lines crowd geometrically towards all
//           four sides, hence to the singular corners (0,0), (0,1), (1,0):
//           a middle cell is `grading` times as wide as a cell at the wall, and cells
//           in the middle of a side are that much longer than thick.

DefineConstant[ size = {0.125, Name "Parameters/size"} ];
DefineConstant[
  n = {Floor(1 / size + 0.5), Name "Parameters/n"},
  diagonal = {0, Choices{0 = "right", 1 = "left", 2 = "alternating"}, Name "Parameters/diagonal"},
  grading = {1, Name "Parameters/grading"}
];
If(n < 1)
  Error("n must be at least 1");
  Abort;
EndIf

// Widths w, ratio w, ... up to the middle and back; `lines` is where each cell ends.
ratio = grading ^ (1 / (Floor((n - 1) / 2) > 0 ? Floor((n - 1) / 2) : 1));
total = 0;
For i In {0 : n - 1}
  width[i] = ratio ^ (i < n - 1 - i ? i : n - 1 - i);
  total += width[i];
EndFor
sum = 0;
For i In {0 : n - 1}
  sum += width[i];
  one[i] = 1;
  lines[i] = sum / total;
EndFor
lines[n - 1] = 1;

// Extruded points put the nodes of a side exactly on `lines`; a transfinite curve
// would only come within its integration tolerance.
Point(1) = {0, 0, 0};
b[] = Extrude {1, 0, 0} { Point{1}; Layers{one[], lines[]}; };
l[] = Extrude {0, 1, 0} { Point{1}; Layers{one[], lines[]}; };
r[] = Extrude {0, 1, 0} { Point{b[0]}; Layers{one[], lines[]}; };
t[] = Extrude {1, 0, 0} { Point{l[0]}; Layers{one[], lines[]}; };

Curve Loop(1) = {b[1], r[1], -t[1], -l[1]};
Plane Surface(1) = {1};
If(diagonal == 0)
  Transfinite Surface {1} Right;
ElseIf(diagonal == 1)
  Transfinite Surface {1} Left;
Else
  Transfinite Surface {1} Alternate;
EndIf

Physical Surface("body") = {1};
Physical Curve("left") = {l[1]};
Physical Curve("right") = {r[1]};
Physical Curve("top") = {t[1]};
Physical Curve("bottom") = {b[1]};
