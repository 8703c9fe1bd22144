// A block of three layers, the core of another material.
DefineConstant[ size = 0.1 ];
Point(1) = {0, 0, 0, size};    Point(2) = {2, 0, 0, size};
Point(3) = {0, 0.3, 0, size};  Point(4) = {2, 0.3, 0, size};
Point(5) = {0, 0.6, 0, size};  Point(6) = {2, 0.6, 0, size};
Point(7) = {0, 1, 0, size};    Point(8) = {2, 1, 0, size};
Line(1) = {1, 2};  Line(2) = {3, 4};  Line(3) = {5, 6};  Line(4) = {7, 8};
Line(5) = {1, 3};  Line(6) = {3, 5};  Line(7) = {5, 7};
Line(8) = {2, 4};  Line(9) = {4, 6};  Line(10) = {6, 8};
Curve Loop(1) = {1, 8, -2, -5};   Plane Surface(1) = {1};
Curve Loop(2) = {2, 9, -3, -6};   Plane Surface(2) = {2};
Curve Loop(3) = {3, 10, -4, -7};  Plane Surface(3) = {3};
Physical Surface("body") = {1, 2, 3};
Physical Surface("core") = {2};
Physical Surface("cover") = {3};
Physical Curve("foundation") = {1};
Physical Curve("clamp") = {5, 6, 7};
Physical Curve("top") = {4};
Physical Curve("end") = {8, 9, 10};
