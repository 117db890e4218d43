// Half of the block of example 1 (80 × 40, symmetry on the left), fine under the cylinder, in quadrilaterals without any
// structure: gmsh -2 block.geo -o block.msh -format msh41
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 80, 40};
Physical Curve("bottom", 1) = {1};
Physical Curve("right", 2) = {2};
Physical Curve("top", 3) = {3};
Physical Curve("left", 4) = {4};
Physical Point("foot", 5) = {1};
Physical Surface("block", 6) = {1};
// size 0.6 within 16 of the first contact, growing to 5
Field[1] = MathEval;
Field[1].F = "Min(5, 0.6 + 0.14 * Max(0, Sqrt(x*x + (y-40)*(y-40)) - 16))";
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.Algorithm = 8;                 // frontal for quadrilaterals
Mesh.RecombineAll = 1;
Mesh.RecombinationAlgorithm = 3;    // blossom, full quadrilaterals
Mesh.Smoothing = 20;
