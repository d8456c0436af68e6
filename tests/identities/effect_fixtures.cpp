// SPDX-License-Identifier: Apache-2.0
#include "effect_fixtures.h"

#include <fmt/format.h>

namespace velatura::test {

namespace {

using scene::Effect;

// Quads with a surface shader of MaterialX, which has what UsdPreviewSurface has not
#define VELATURA_NODE_QUAD(inputs, nodes)                                                         \
    "def Mesh \"Quad\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) { int[] faceVertexCounts " \
    "= [4]\n"                                                                                     \
    " int[] faceVertexIndices = [0, 1, 2, 3]\n point3f[] points = [(-1, 0, 0.2), (1, 0, 0.2), "   \
    "(1, 2, 0), (-1, 2, 0)]\n"                                                                    \
    " uniform token subdivisionScheme = \"none\"\n"                                               \
    " texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = \"vertex\")\n" \
    " rel material:binding = <@@/Mat> }\n"                                                        \
    "def Material \"Mat\" { token outputs:mtlx:surface.connect = <@@/Mat/S.outputs:out>\n"        \
    " def Shader \"S\" { uniform token info:id = \"ND_standard_surface_surfaceshader\"\n " inputs \
    "\n token outputs:out }\n " nodes " }"

// One instance of a point instancer, which may move
#define VELATURA_SWARM(rows)                                                                      \
    "def PointInstancer \"Swarm\" { rel prototypes = <@@/Swarm/Box>\n int[] protoIndices = [0]\n" \
    " point3f[] positions.timeSamples = { 0: [(0, 1, 0)] }\n " rows                               \
    "\n def Cube \"Box\" { double size = 0.3 } }"

// A triangle that may change its shape
#define VELATURA_SAIL(rows)                                                                    \
    "def Mesh \"Sail\" { int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n" \
    " uniform token subdivisionScheme = \"none\"\n " rows " }"
// A box of matter without a surface
#define VELATURA_FOG(inputs)                                                                      \
    "def Cube \"Fog\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) { double size = 0.8\n rel " \
    "material:binding = <@@/Mat> }\n"                                                             \
    "def Material \"Mat\" { token outputs:volume.connect = <@@/Mat/V.outputs:out>\n"              \
    " def Shader \"V\" { uniform token info:id = \"ND_anisotropic_vdf\"\n " inputs                \
    "\n token outputs:out } }"

constexpr EffectFixture fixtures[] = {
    {Effect::Sheen, "constant", VELATURA_NODE_QUAD("float inputs:sheen = 0.5", ""),
     VELATURA_NODE_QUAD("float inputs:sheen = 0", ""), true},
    {Effect::Sheen, "by a ramp",
     VELATURA_NODE_QUAD("float inputs:sheen.connect = <@@/Mat/N.outputs:out>",
                        "def Shader \"N\" { uniform token info:id = \"ND_ramplr_float\"\n float "
                        "inputs:valuer = 0.5\n float outputs:out }"),
     VELATURA_NODE_QUAD("float inputs:sheen = 0.5\n color3f inputs:sheen_color = (0, 0, 0)", ""),
     true},
    {Effect::RoughDiffuse, "constant",
     VELATURA_NODE_QUAD("float inputs:diffuse_roughness = 0.5", ""),
     VELATURA_NODE_QUAD("float inputs:diffuse_roughness = 0", ""), true},
    {Effect::ThinFilm, "constant", VELATURA_NODE_QUAD("float inputs:thin_film_thickness = 400", ""),
     VELATURA_NODE_QUAD("float inputs:thin_film_thickness = 0", ""), true},
    {Effect::ThinFilm, "by a ramp, on metal",
     VELATURA_NODE_QUAD(
         "float inputs:metalness = 1\n float inputs:thin_film_thickness.connect = "
         "<@@/Mat/N.outputs:out>",
         "def Shader \"N\" { uniform token info:id = \"ND_ramplr_float\"\n float inputs:valuer = "
         "600\n float outputs:out }"),
     "", true},
    {Effect::Dispersion, "constant",
     VELATURA_NODE_QUAD("float inputs:transmission = 1\n float inputs:transmission_dispersion = "
                        "20\n bool inputs:thin_walled = 0",
                        ""),
     VELATURA_NODE_QUAD("float inputs:transmission = 1\n float inputs:transmission_dispersion = "
                        "0\n bool inputs:thin_walled = 0",
                        ""),
     true},
    {Effect::Patterns, "ramp",
     VELATURA_NODE_QUAD(
         "color3f inputs:base_color.connect = <@@/Mat/N.outputs:out>",
         "def Shader \"N\" { uniform token info:id = \"ND_ramplr_color3\"\n color3f inputs:valuel "
         "= (0.1, 0.5, 0.9)\n color3f inputs:valuer = (0.9, 0.3, 0.1)\n color3f outputs:out }"),
     VELATURA_NODE_QUAD(
         "color3f inputs:base_color.connect = <@@/Mat/N.outputs:out>",
         "def Shader \"N\" { uniform token info:id = \"ND_mix_color3\"\n color3f inputs:bg = (0.1, "
         "0.5, 0.9)\n float inputs:mix = 0.5\n color3f outputs:out }"),
     true},
    {Effect::Patterns, "noise in the object",
     VELATURA_NODE_QUAD(
         "float inputs:specular_roughness.connect = <@@/Mat/N.outputs:out>",
         "def Shader \"N\" { uniform token info:id = \"ND_fractal3d_float\"\n float outputs:out }"),
     "", true},
    {Effect::Clearcoat, "constant", "float inputs:clearcoat = 0.5", "float inputs:clearcoat = 0"},
    {Effect::Clearcoat, "primvar",
     "float inputs:clearcoat.connect = <@@/Mat/Reader.outputs:result>",
     "float inputs:clearcoat = 0\nfloat inputs:clearcoatRoughness = 0.5"},
    {Effect::VaryingColors, "primvar",
     "float inputs:roughness.connect = <@@/Mat/Reader.outputs:result>", ""},
    {Effect::Textures, "texture",
     "color3f inputs:diffuseColor.connect = <@@/Mat/Picture.outputs:rgb>", ""},
    {Effect::Textures, "textured opacity",
     "float inputs:opacity.connect = <@@/Mat/Picture.outputs:a>", ""},
    {Effect::NormalMaps, "constant", "normal3f inputs:normal = (0.1, 0, 1)",
     "normal3f inputs:normal = (0, 0, 1)"},
    {Effect::Cutouts, "threshold",
     "float inputs:opacity = 0.2\nfloat inputs:opacityThreshold = 0.5",
     "float inputs:opacity = 1\nfloat inputs:opacityThreshold = 0.5"},
    {Effect::Cutouts, "presence",
     "float inputs:opacity = 0.2\ntoken inputs:opacityMode = \"presence\"",
     "float inputs:opacity = 1\ntoken inputs:opacityMode = \"presence\""},
    {Effect::Cutouts, "primvar",
     "float inputs:opacity.connect = <@@/Mat/Reader.outputs:result>\nfloat inputs:opacityThreshold "
     "= 0.5",
     "float inputs:opacity = 0.7\nfloat inputs:opacityThreshold = 0.5"},
    {Effect::Transmission, "constant", "float inputs:opacity = 0.5", "float inputs:opacity = 1"},
    {Effect::RoughTransmission, "constant",
     "float inputs:opacity = 0.1\nbool inputs:velatura:roughTransmission = 1",
     "float inputs:opacity = 1\nbool inputs:velatura:roughTransmission = 1"},
    {Effect::ThinWalls, "constant",
     "bool inputs:velatura:thinWalled = 1\nfloat inputs:opacity = 0.5",
     "bool inputs:velatura:thinWalled = 0\nfloat inputs:opacity = 0.5"},
    {Effect::DiffuseTransmission, "constant",
     "bool inputs:velatura:thinWalled = 1\nfloat inputs:velatura:diffuseTransmission = 0.5",
     "bool inputs:velatura:thinWalled = 1\nfloat inputs:velatura:diffuseTransmission = 0"},
    {Effect::Absorption, "constant",
     "float inputs:opacity = 0\nfloat inputs:velatura:transmissionDepth = 1\ncolor3f "
     "inputs:velatura:transmissionColor = (0.5, 0.7, 0.9)",
     "float inputs:opacity = 0\nfloat inputs:velatura:transmissionDepth = 1\ncolor3f "
     "inputs:velatura:transmissionColor = (1, 1, 1)"},
    {Effect::InteriorMedia, "constant",
     "float inputs:opacity = 0\nfloat inputs:velatura:transmissionDepth = 1\ncolor3f "
     "inputs:velatura:transmissionColor = (0.2, 0.2, 0.2)\ncolor3f "
     "inputs:velatura:transmissionScatter = (0.5, 0.7, 0.9)",
     "float inputs:opacity = 0\nfloat inputs:velatura:transmissionDepth = 1\ncolor3f "
     "inputs:velatura:transmissionColor = (0.2, 0.2, 0.2)\ncolor3f "
     "inputs:velatura:transmissionScatter = (0, 0, 0)"},
    {Effect::InteriorMedia, "standard surface",
     VELATURA_NODE_QUAD("float inputs:transmission = 1\n float inputs:transmission_depth = 1\n "
                        "color3f inputs:transmission_color = (0.2, 0.2, 0.2)\n color3f "
                        "inputs:transmission_scatter = (0.5, 0.7, 0.9)",
                        ""),
     VELATURA_NODE_QUAD("float inputs:transmission = 0\n float inputs:transmission_depth = 1\n "
                        "color3f inputs:transmission_scatter = (0.5, 0.7, 0.9)",
                        ""),
     true},
    {Effect::InteriorMedia, "volume shader",
     VELATURA_FOG(
         "float3 inputs:absorption = (0.1, 0.2, 0.3)\n float3 inputs:scattering = (0.9, 0.8, 0.7)"),
     VELATURA_FOG("float3 inputs:absorption = (0.1, 0.2, 0.3)"), true},
    {Effect::NestedDielectrics, "constant",
     "float inputs:opacity = 0\nint inputs:velatura:dielectricPriority = 2",
     "float inputs:opacity = 0\nint inputs:velatura:dielectricPriority = 0"},
    {Effect::NestedDielectrics, "of what is opaque",
     "float inputs:opacity = 0.2\nint inputs:velatura:dielectricPriority = -1",
     "int inputs:velatura:dielectricPriority = 2"},
    {Effect::Subsurface, "constant",
     "float inputs:velatura:subsurface = 0.8\ncolor3f inputs:velatura:subsurfaceRadius = (0.3, "
     "0.1, 0.05)",
     "float inputs:velatura:subsurface = 0\ncolor3f inputs:velatura:subsurfaceRadius = (0.3, 0.1, "
     "0.05)"},
    {Effect::Anisotropy, "constant", "float inputs:velatura:anisotropy = 0.5",
     "float inputs:velatura:anisotropy = 0"},
    {Effect::SurfaceEmission, "constant", "color3f inputs:emissiveColor = (0, 0, 1)",
     "color3f inputs:emissiveColor = (0, 0, 0)"},
    {Effect::Quadrics, "sphere", "def Sphere \"Ball\" { double radius = 0.3 }",
     "def Cube \"Ball\" { double size = 0.3 }", true},
    {Effect::Curves, "strand",
     "def BasisCurves \"Hair\" { int[] curveVertexCounts = [4]\n point3f[] points = [(-1, 0, 0), "
     "(-0.3, 2, 0), (0.3, 2, 0), (1, 0, 0)]\n float[] widths = [0.3] }",
     "def Cube \"Ball\" { double size = 0.3 }", true},
    {Effect::Curves, "ribbon",
     "def BasisCurves \"Grass\" { int[] curveVertexCounts = [2]\n uniform token type = "
     "\"linear\"\n point3f[] points = [(0, 0, 0), (0, 2, 0)]\n float[] widths = [0.3]\n normal3f[] "
     "normals = [(0, 0, 1)] }",
     "", true},
    {Effect::Hair, "strand",
     "def BasisCurves \"Lock\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) { int[] "
     "curveVertexCounts = [4]\n point3f[] points = [(-1, 0, 0), (-0.3, 2, 0), (0.3, 2, 0), (1, 0, "
     "0)]\n float[] widths = [0.3]\n rel material:binding = <@@/Brown> }\ndef Material \"Brown\" { "
     "token outputs:surface.connect = <@@/Brown/S.outputs:surface>\n def Shader \"S\" { uniform "
     "token info:id = \"VelaturaHair\"\n token outputs:surface } }",
     "def Cube \"Box\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) { double size = 0.3\n rel "
     "material:binding = <@@/Brown> }\ndef Material \"Brown\" { token outputs:surface.connect = "
     "<@@/Brown/S.outputs:surface>\n def Shader \"S\" { uniform token info:id = \"VelaturaHair\"\n "
     "token outputs:surface } }",
     true},
    {Effect::Points, "ball",
     "def Points \"Dust\" { point3f[] points = [(0, 1, 0)]\n float[] widths = [0.5] }",
     "def Cube \"Ball\" { double size = 0.3 }", true},
    {Effect::VaryingColors, "displayColor",
     "def Cube \"Box\" { color3f[] primvars:displayColor = [(1, 0, 0)] }",
     "def Cube \"Box\" { double size = 0.3 }", true},
    {Effect::LightTextures, "picture",
     "def RectLight \"L\" { asset inputs:texture:file = @picture.exr@ }",
     "def RectLight \"L\" { float inputs:intensity = 0\n asset inputs:texture:file = @picture.exr@ "
     "}",
     true},
    {Effect::LightShaping, "cone",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { float "
     "inputs:shaping:cone:angle = 40 }",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { float "
     "inputs:shaping:cone:angle = 180 }",
     true},
    {Effect::LightShaping, "focus",
     "def DiskLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { float inputs:shaping:focus = 2 "
     "}",
     "def DiskLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { float inputs:shaping:focus = 0 "
     "}",
     true},
    {Effect::LightProfiles, "profile",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { asset "
     "inputs:shaping:ies:file = @velatura_identity_lamp.ies@ }",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { float inputs:intensity = 0\n "
     "asset inputs:shaping:ies:file = @velatura_identity_lamp.ies@ }",
     true},
    {Effect::LobeMultipliers, "diffuse", "def CylinderLight \"L\" { float inputs:diffuse = 0.5 }",
     "def CylinderLight \"L\" { float inputs:diffuse = 1 }", true},
    {Effect::LightLinking, "light link",
     "def Cube \"Box\" { double size = 0.3 }\ndef SphereLight \"L\" { float inputs:intensity = 2\n "
     "rel collection:lightLink:excludes = <@@/Box> }",
     "def Cube \"Box\" { double size = 0.3 }\ndef SphereLight \"L\" { float inputs:intensity = 2\n "
     "rel collection:lightLink:excludes = <@@/Sphere> }",
     true},
    {Effect::LightLinking, "shadow link",
     "def Cube \"Box\" { double size = 0.3 }\ndef SphereLight \"L\" { float inputs:intensity = 2\n "
     "rel collection:shadowLink:excludes = <@@/Box> }",
     "def Cube \"Box\" { double size = 0.3 }\ndef SphereLight \"L\" { float inputs:intensity = 0\n "
     "rel collection:shadowLink:excludes = <@@/Box> }",
     true},
    {Effect::RayVisibility, "switch",
     "def Cube \"Box\" { double size = 0.3\n bool primvars:arnold:visibility:shadow = 0 }",
     "def Cube \"Box\" { double size = 0.3\n bool primvars:arnold:visibility:shadow = 1 }", true},
    {Effect::RayVisibility, "camera",
     "def Cube \"Box\" { double size = 0.3\n bool primvars:velatura:visibility:camera = 0 }",
     "def Cube \"Box\" { double size = 0.3\n bool primvars:velatura:visibility:camera = 1 }", true},
    {Effect::Mattes, "matte",
     "def Cube \"Box\" { double size = 0.3\n bool primvars:arnold:matte = 1 }",
     "def Cube \"Box\" { double size = 0.3\n bool primvars:arnold:matte = 0 }", true},
    {Effect::Catchers, "catcher",
     "def Cube \"Box\" { double size = 0.3\n bool primvars:velatura:catcher = 1 }",
     "def Cube \"Box\" { double size = 0.3\n bool primvars:velatura:catcher = 0 }", true},
    {Effect::ShadowControls, "distance",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShadowAPI\"]) { float inputs:shadow:distance "
     "= 0.5 }",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShadowAPI\"]) { float inputs:shadow:distance "
     "= -1 }",
     true},
    {Effect::ShadowControls, "off",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShadowAPI\"]) { bool inputs:shadow:enable = 0 "
     "}",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShadowAPI\"]) { color3f inputs:shadow:color = "
     "(0, 0, 0) }",
     true},
    {Effect::LightFilters, "intensity",
     "def PxrIntMultLightFilter \"F\" { float inputs:intensity = 0.5 }\ndef SphereLight \"L\" { "
     "float inputs:intensity = 2\n rel light:filters = <@@/F> }",
     "def PxrIntMultLightFilter \"F\" { float inputs:intensity = 0.5 }\ndef SphereLight \"L\" { "
     "float inputs:intensity = 0\n rel light:filters = <@@/F> }",
     true},
    {Effect::LightSelection, "second light", "def SphereLight \"L\" { float inputs:intensity = 1 }",
     "def SphereLight \"L\" { float inputs:intensity = 0 }", true},
    {Effect::Environment, "dome", "def DomeLight \"D\" { float inputs:intensity = 0.5 }",
     "def DomeLight \"D\" { float inputs:intensity = 0 }", true, true},
    {Effect::EnvironmentMaps, "dome with a picture",
     "def DomeLight \"D\" { asset inputs:texture:file = @picture.exr@ }",
     "def DomeLight \"D\" { color3f inputs:color = (0, 0, 0)\n asset inputs:texture:file = "
     "@picture.exr@ }",
     true, true},
    {Effect::Volumes, "density",
     "def Volume \"V\" { rel field:density = <@@/V/D>\n def OpenVDBAsset \"D\" { token fieldName = "
     "\"waves\" } }",
     "def Volume \"V\" { rel field:density = <@@/V/D>\n def OpenVDBAsset \"D\" { token fieldName = "
     "\"zeros\" } }",
     true},
    {Effect::Volumes, "heat",
     "def Volume \"V\" { rel field:heat = <@@/V/H>\n def OpenVDBAsset \"H\" { token fieldName = "
     "\"waves\" } }",
     "def Volume \"V\" { float velatura:volume:emissionScale = 0\n rel field:heat = <@@/V/H>\n def "
     "OpenVDBAsset \"H\" { token fieldName = \"waves\" } }",
     true},
    {Effect::TransformBlur, "velocities of instances",
     VELATURA_SWARM("quatf[] orientationsf = [(1, 0, 0, 0)]\n vector3f[] velocities.timeSamples = "
                    "{ 0: [(24, 0, 0)] }"),
     VELATURA_SWARM("quatf[] orientationsf = [(1, 0, 0, 0)]\n vector3f[] velocities.timeSamples = "
                    "{ 0: [(0, 0, 0)] }"),
     true},
    {Effect::TransformBlur, "angular velocities",
     VELATURA_SWARM("quatf[] orientationsf.timeSamples = { 0: [(1, 0, 0, 0)] }\n vector3f[] "
                    "angularVelocities.timeSamples = { 0: [(0, 2400, 0)] }"),
     VELATURA_SWARM("quatf[] orientationsf.timeSamples = { 0: [(1, 0, 0, 0)] }\n vector3f[] "
                    "angularVelocities.timeSamples = { 0: [(0, 0, 0)] }"),
     true},
    {Effect::TransformBlur, "samples of instances",
     VELATURA_SWARM("float3[] scales.timeSamples = { 0: [(1, 1, 1)], 1: [(2, 1, 1)] }"),
     VELATURA_SWARM(
         "float3[] scales.timeSamples = { 0: [(1, 1, 1)], 1: [(1, 1, 1)], 2: [(2, 1, 1)] }"),
     true},
    {Effect::TransformBlur, "sphere",
     "def Sphere \"Ball\" { double radius = 0.3\n double3 xformOp:translate.timeSamples = { 0: (0, "
     "1, 0), 1: (1, 1, 0) }\n uniform token[] xformOpOrder = [\"xformOp:translate\"] }",
     "def Sphere \"Ball\" { double radius = 0.3\n double3 xformOp:translate.timeSamples = { 0: (0, "
     "1, 0), 1: (0, 1, 0) }\n uniform token[] xformOpOrder = [\"xformOp:translate\"] }",
     true},
    {Effect::TransformBlur, "dust",
     "def Points \"Dust\" { point3f[] points = [(0, 1, 0)]\n float[] widths = [0.5]\n float "
     "xformOp:rotateZ.timeSamples = { 0: 0, 1: 90 }\n uniform token[] xformOpOrder = "
     "[\"xformOp:rotateZ\"] }",
     "def Points \"Dust\" { point3f[] points = [(0, 1, 0)]\n float[] widths = [0.5]\n float "
     "xformOp:rotateZ.timeSamples = { 0: 90, 1: 90 }\n uniform token[] xformOpOrder = "
     "[\"xformOp:rotateZ\"] }",
     true},
    {Effect::TransformBlur, "light",
     "def SphereLight \"L\" { float inputs:intensity = 2\n double3 "
     "xformOp:translate.timeSamples = { 0: (0, 2, 0), 1: (1, 2, 0) }\n uniform token[] "
     "xformOpOrder "
     "= [\"xformOp:translate\"] }",
     "def SphereLight \"L\" { float inputs:intensity = 2\n double3 "
     "xformOp:translate.timeSamples = { 0: (0, 2, 0), 1: (0, 2, 0) }\n uniform token[] "
     "xformOpOrder "
     "= [\"xformOp:translate\"] }",
     true},
    {Effect::TransformBlur, "dust that falls",
     "def Points \"Dust\" { point3f[] points.timeSamples = { 0: [(0, 1, 0)] }\n vector3f[] "
     "velocities.timeSamples = { 0: [(0, -24, 0)] }\n float[] widths = [0.5] }",
     "def Points \"Dust\" { point3f[] points.timeSamples = { 0: [(0, 1, 0)] }\n vector3f[] "
     "velocities.timeSamples = { 0: [(0, 0, 0)] }\n float[] widths = [0.5] }",
     true},
    {Effect::DeformationBlur, "samples of points",
     VELATURA_SAIL("point3f[] points.timeSamples = { 0: [(-1, 0, 0), (1, 0, 0), (0, 2, 0)], 1: "
                   "[(-1, 0, 0), (1, 0, 0), (1, 2, 0)] }"),
     VELATURA_SAIL("point3f[] points.timeSamples = { 0: [(-1, 0, 0), (1, 0, 0), (0, 2, 0)], 1: "
                   "[(-1, 0, 0), (1, 0, 0), (0, 2, 0)] }"),
     true},
    {Effect::DeformationBlur, "velocities of points",
     VELATURA_SAIL("point3f[] points.timeSamples = { 0: [(-1, 0, 0), (1, 0, 0), (0, 2, 0)] }\n "
                   "vector3f[] velocities.timeSamples = { 0: [(0, 0, 0), (0, 0, 0), (24, 0, 0)] }"),
     VELATURA_SAIL("float motion:blurScale = 0\n point3f[] points.timeSamples = { 0: [(-1, 0, 0), "
                   "(1, 0, 0), (0, 2, 0)] }\n vector3f[] velocities.timeSamples = { 0: [(0, 0, 0), "
                   "(0, 0, 0), (24, 0, 0)] }"),
     true},
    {Effect::LevelSets, "class of the field",
     "def Volume \"V\" { rel field:surface = <@@/V/D>\n def OpenVDBAsset \"D\" { token fieldName = "
     "\"ball\"\n token fieldClass = \"levelSet\" } }",
     "def Volume \"V\" { rel field:density = <@@/V/D>\n def OpenVDBAsset \"D\" { token fieldName = "
     "\"waves\"\n token fieldClass = \"fogVolume\" } }",
     true},
    {Effect::LevelSets, "class of the grid",
     "def Volume \"V\" { rel field:density = <@@/V/D>\n def OpenVDBAsset \"D\" { token fieldName = "
     "\"ball\" } }",
     "def Volume \"V\" { rel field:density = <@@/V/D>\n def OpenVDBAsset \"D\" { token fieldName = "
     "\"zeros\" } }",
     true},
    {Effect::MeshLights, "cube",
     "def Cube \"L\" (prepend apiSchemas = [\"LightAPI\"]) { double size = 0.2\n float "
     "inputs:intensity = 3\n token light:materialSyncMode = \"noMaterialResponse\" }",
     "def Cube \"L\" (prepend apiSchemas = [\"LightAPI\"]) { double size = 0.2\n float "
     "inputs:intensity = 0\n token light:materialSyncMode = \"noMaterialResponse\" }",
     true},
};

#undef VELATURA_SAIL
#undef VELATURA_SWARM
#undef VELATURA_FOG
#undef VELATURA_NODE_QUAD

/// A quad in front of the camera with a material of its own; as prims of what has the path.
std::string quad_with_material(std::string_view inputs, std::string_view path) {
    return fmt::format(R"usda(
    def Mesh "Quad" (prepend apiSchemas = ["MaterialBindingAPI"])
    {{
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-1, 0, 0.2), (1, 0, 0.2), (1, 2, 0), (-1, 2, 0)]
        uniform token subdivisionScheme = "none"
        float primvars:amount = 0.4
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
        rel material:binding = <{0}/Mat>
    }}
    def Material "Mat"
    {{
        token outputs:surface.connect = <{0}/Mat/S.outputs:surface>
        def Shader "S"
        {{
            uniform token info:id = "UsdPreviewSurface"
            {1}
            token outputs:surface
        }}
        def Shader "Reader"
        {{
            uniform token info:id = "UsdPrimvarReader_float"
            string inputs:varname = "amount"
            float outputs:result
        }}
        def Shader "Picture"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @picture.png@
            float2 inputs:st = (0.5, 0.5)
            color3f outputs:rgb
            float outputs:a
        }}
    }})usda",
                       path, inputs);
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

/// The text with every closing brace on a line of its own, as the grammar wants it.
std::string lined(std::string text) {
    return replaced(std::move(text), " }", "\n}\n");
}

constexpr std::string_view head = R"usda(#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Y"
)
)usda";

constexpr std::string_view home = R"usda(
    def Camera "Cam"
    {
        float focalLength = 24
        float2 clippingRange = (0, 0)
        double shutter:close = 0.5
        double3 xformOp:translate = (0, 1, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "Floor"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)]
        uniform token subdivisionScheme = "none"
    }
    def RectLight "Lamp"
    {
        float inputs:intensity = 6
        double3 xformOp:translate = (0, 3, 1)
        float xformOp:rotateX = -70
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }
)usda";

}  // namespace

const char* name_of(Arrival arrival) {
    constexpr const char* names[] = {
        "direct",    "deep",    "instance", "nested instance", "point instance", "variant",
        "reference", "inherit", "payload",  "specialize",      "untyped parent"};
    return names[size_t(arrival)];
}

std::span<const EffectFixture> effect_fixtures() {
    return fixtures;
}

std::string fixture_prims(const EffectFixture& fixture,
                          std::string_view content,
                          std::string_view path) {
    const std::string text = replaced(std::string(content), "@@", path);
    return fixture.is_prim ? text : quad_with_material(text, path);
}

namespace {

std::string arrived(const EffectFixture& fixture, std::string_view content, Arrival arrival) {
    const auto world = [&](std::string_view more) {
        return fmt::format("def Xform \"World\"\n{{{}{}\n}}\n", home, more);
    };
    const auto item = [&](const char* specifier) {
        return fmt::format("{} Xform \"Item\"\n{{{}\n}}\n", specifier,
                           fixture_prims(fixture, content, "/Item"));
    };
    const auto with_arc = [&](const char* specifier, std::string_view metadata) {
        return std::string(head) + item(specifier) +
               world(fmt::format("\ndef Xform \"A\" ({}) {{}}\n", metadata));
    };
    switch (arrival) {
        case Arrival::Direct:
            return std::string(head) + world(fixture_prims(fixture, content, "/World"));
        case Arrival::Deep:
            return std::string(head) +
                   world(fmt::format(
                       "\ndef Xform \"A\" {{ def Scope \"B\" {{ def Xform \"C\" {{ {} }} }} }}",
                       fixture_prims(fixture, content, "/World/A/B/C")));
        case Arrival::Untyped:
            return std::string(head) +
                   world(fmt::format("\ndef \"A\" {{ {} }}",
                                     fixture_prims(fixture, content, "/World/A")));
        case Arrival::Instance:
            return with_arc("class", "instanceable = true\nprepend references = </Item>");
        case Arrival::NestedInstance:
            return std::string(head) + item("class") +
                   "class Xform \"Outer\" { def Xform \"B\" (instanceable = true\nprepend "
                   "references = </Item>) {} }\n" +
                   world(
                       "\ndef Xform \"A\" (instanceable = true\nprepend references = </Outer>) "
                       "{}\n");
        case Arrival::PointInstance:
            return std::string(head) + item("class") +
                   world(
                       "\ndef PointInstancer \"P\" { int[] protoIndices = [0]\n point3f[] "
                       "positions = [(0, 0, 0)]\n rel prototypes = </World/P/Item>\n def Xform "
                       "\"Item\" (prepend references = </Item>) {} }\n");
        case Arrival::Variant:
            return std::string(head) +
                   world(fmt::format("\ndef Xform \"A\" (variants = {{ string look = \"full\" "
                                     "}}\nprepend variantSets = \"look\") {{ variantSet \"look\" = "
                                     "{{ \"empty\" {{ }} \"full\" {{ {} }} }} }}",
                                     fixture_prims(fixture, content, "/World/A")));
        case Arrival::Reference:
            return with_arc("class", "prepend references = </Item>");
        case Arrival::Inherit:
            return with_arc("class", "prepend inherits = </Item>");
        case Arrival::Payload:
            return with_arc("class", "prepend payload = </Item>");
        case Arrival::Specialize:
            return with_arc("class", "prepend specializes = </Item>");
    }
    return {};
}

}  // namespace

std::string fixture_usda(const EffectFixture& fixture, std::string_view content, Arrival arrival) {
    return lined(arrived(fixture, content, arrival));
}

}  // namespace velatura::test
