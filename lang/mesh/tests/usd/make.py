"""Writes block.usdc and block.usdz from block.usda, with y up and in metres: `pip install usd-core`, then this in its folder."""

from pxr import Gf, Sdf, Usd, UsdGeom, UsdUtils

stage = Usd.Stage.CreateNew("block.usdc")
UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
UsdGeom.SetStageMetersPerUnit(stage, 1.0)
mesh = UsdGeom.Mesh.Define(stage, "/block")
corners = [(5 + 40 * (i & 1), 5 + 20 * (i >> 1 & 1), 5 + 10 * (i >> 2)) for i in range(8)]
# z up becomes y up: (x, y, z) is written (x, z, -y).
mesh.CreatePointsAttr([Gf.Vec3f(x / 1e3, z / 1e3, -y / 1e3) for x, y, z in corners])
sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
# Counted the other way round, which the file says.
mesh.CreateFaceVertexCountsAttr([4] * 6)
mesh.CreateFaceVertexIndicesAttr([i for side in sides for i in reversed(side)])
mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
stage.SetDefaultPrim(mesh.GetPrim())
stage.Save()

root = Usd.Stage.CreateNew("packed.usda")
UsdGeom.SetStageUpAxis(root, UsdGeom.Tokens.y)
UsdGeom.SetStageMetersPerUnit(root, 1.0)
prim = root.DefinePrim("/packed", "Xform")
block = root.DefinePrim("/packed/block")
block.GetReferences().AddReference("block.usdc")
root.SetDefaultPrim(prim)
root.Save()
UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath("packed.usda"), "block.usdz")
