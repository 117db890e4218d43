"""Files of other programs: meshes and decks of Abaqus, meshes of gmsh, outlines in DXF."""
