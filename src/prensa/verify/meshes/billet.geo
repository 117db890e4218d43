// Quarter of the billet of the upsetting cases (radius 10, half height 7.5), finer towards the corner under the die, in
// quadrilaterals without any structure: gmsh -2 billet.geo -o billet.msh -format msh41
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 10, 7.5};
Physical Curve("bottom", 1) = {1};
Physical Curve("right", 2) = {2};
Physical Curve("top", 3) = {3};
Physical Curve("axis", 4) = {4};
Physical Surface("billet", 5) = {1};
Field[1] = MathEval;
Field[1].F = "Min(0.9, 0.3 + 0.12 * Sqrt((x-10)*(x-10) + (y-7.5)*(y-7.5)))";
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.Algorithm = 8;
Mesh.RecombineAll = 1;
Mesh.RecombinationAlgorithm = 3;
Mesh.Smoothing = 20;
