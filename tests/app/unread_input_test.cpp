// SPDX-License-Identifier: Apache-2.0
// What a scene says and no render reads: typing errors, unknown types, attributes of other
// renderers and of newer schemas. Each is named once, with the place, the nearest name and what is
// done; the image is written and the exit code is 0.
#include "command.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace velatura::test {

namespace {

struct Case {
    const char* prims;
    const char* message;  ///< nothing: there is no warning
};

constexpr const char* camera = R"usda(
def Camera "Cam" {
    double3 xformOp:translate = (0, 0, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Sky" {}
)usda";

const Case cases[] = {
    // Attributes near to those of the schema
    {"def RectLight \"L\" { float inputs:intensty = 5 }",
     "s.usda:8:45: warning: RectLight has no attribute inputs:intensty (did you mean "
     "'inputs:intensity'?); it is ignored [unknown-attribute]"},
    {"def RectLight \"L\" { float input:intensity = 5 }", "did you mean 'inputs:intensity'?"},
    {"def RectLight \"L\" { color3f inputs:colour = (1, 0, 0) }", "did you mean 'inputs:color'?"},
    {"def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { float "
     "inputs:shaping:cone:angel = 5 }",
     "did you mean 'inputs:shaping:cone:angle'?"},
    {"def Camera \"C\" { float focallength = 35 }",
     "Camera has no attribute focallength (did you mean 'focalLength'?); it is ignored"},
    {"def Camera \"C\" { float fstop = 2 }", "did you mean 'fStop'?"},
    {"def Camera \"C\" { float exposure:fstop = 2 }", "did you mean 'exposure:fStop'?"},
    {"def RenderSettings \"R\" { uniform int2 resoltion = (64, 48) }",
     "did you mean 'resolution'?"},
    {"def Mesh \"M\" { int[] faceVertexCount = [3]\n int[] faceVertexIndices = [0, 1, 2]\n "
     "point3f[] "
     "points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)] }",
     "did you mean 'faceVertexCounts'?"},
    {"def Sphere \"S\" { double raduis = 2 }", "did you mean 'radius'?"},
    {"def Sphere \"S\" { color3f[] displayColor = [(1, 0, 0)] }",
     "did you mean 'primvars:displayColor'?"},
    {"def Sphere \"S\" { color3f[] primvars:displaycolor = [(1, 0, 0)] }",
     "did you mean 'primvars:displayColor'?"},
    {"def Sphere \"S\" { token visiblity = \"invisible\" }", "did you mean 'visibility'?"},
    {"def Material \"M\" { token outputs:surfce }", "did you mean 'outputs:surface'?"},
    // Terminals of other renderers, and what a pipeline calls its own
    {"def Material \"M\" { token outputs:mdl:surface\n token outputs:mdl:displacement\n token "
     "outputs:mdl:volume }",
     nullptr},
    {"def Material \"M\" { token outputs:mtxl:surface }", "did you mean 'outputs:mtlx:surface'?"},
    {"def Scope \"S\" { rel camera = </Cam> }", nullptr},
    {"def Sphere \"S\" { bool catcher = 1 }", "did you mean 'primvars:velatura:catcher'?"},
    {"def Material \"M\" { token outputs:surface.connect = </M/S.outputs:surface>\n def Shader "
     "\"S\" "
     "{ uniform token info:id = \"UsdPreviewSurface\"\n float inputs:rougness = 1\n token "
     "outputs:surface } }\ndef Sphere \"B\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) { rel "
     "material:binding = </M> }",
     "UsdPreviewSurface has no input rougness (did you mean 'roughness'?)"},
    {"def Shader \"T\" { uniform token info:id = \"UsdUVTexture\"\n token inputs:warpS = "
     "\"repeat\" }",
     "did you mean 'inputs:wrapS'?"},
    {"def SphereLight \"L\" { string velatura:light:grup = \"key\" }",
     "did you mean 'velatura:light:group'?"},
    {"def Sphere \"S\" { float velatura:sparkle = 1 }", "Sphere has no attribute velatura:sparkle"},
    // Relationships and collections
    {"def Sphere \"S\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) { rel material:bindng = "
     "</M> }",
     "Sphere has no relationship material:bindng (did you mean 'material:binding'?)"},
    {"def Sphere \"S\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) { rel material:binding:ful "
     "= "
     "</M> }",
     "did you mean 'material:binding:full'?"},
    {"def SphereLight \"L\" { rel collection:lightLink:include = </Sky> }",
     "did you mean 'collection:lightLink:includes'?"},
    {"def PointInstancer \"I\" { rel prototype = </Sky>\n int[] protoIndices = []\n point3f[] "
     "positions = [] }",
     "did you mean 'prototypes'?"},
    // Types and API schemas
    {"def SphereLigth \"L\" {}",
     "s.usda:8:1: warning: unknown type SphereLigth (did you mean 'SphereLight'?); the prim is "
     "skipped, what is below it is not [unknown-type]"},
    {"def Mehs \"M\" {}", "unknown type Mehs (did you mean 'Mesh'?)"},
    {"def PxrDomeLight \"L\" {}", "unknown type PxrDomeLight (did you mean 'DomeLight'?)"},
    {"def Unicorn \"U\" {}", "unknown type Unicorn; the prim is skipped"},
    {"def Sphere \"S\" (prepend apiSchemas = [\"MaterialBindingApi\"]) {}",
     "unknown API schema MaterialBindingApi (did you mean 'MaterialBindingAPI'?)"},
    // Metadata and tokens
    {"def Sphere \"S\" (prepend apiSchema = [\"MaterialBindingAPI\"]) {}",
     "unknown metadata apiSchema (did you mean 'apiSchemas'?)"},
    {"def Sphere \"S\" { color3f[] primvars:displayColor = [(1, 0, 0)] (interpolatin = "
     "\"constant\") }",
     "unknown metadata interpolatin of primvars:displayColor (did you mean 'interpolation'?)"},
    {"def Sphere \"S\" { uniform token purpose = \"rendr\" }",
     "purpose is \"rendr\", expected default, render, proxy, guide (did you mean 'render'?); the "
     "prim is not rendered [unknown-token]"},
    {"def Cylinder \"S\" { uniform token axis = \"x\" }", "(did you mean 'X'?); Z is used"},
    // Values of another type than the schema's
    {"def Sphere \"S\" { float visibility = 0 }",
     "s.usda:8:37: warning: visibility is float, expected token; the value is ignored "
     "[attribute-type]"},
    {"def Sphere \"S\" { uniform token[] purpose = [\"proxy\"] }",
     "purpose is token[], expected token"},
    {"def Sphere \"S\" { string radius = \"2\" }", "radius is string, expected double"},
    {"def SphereLight \"L\" { color3f inputs:exposure.timeSamples = { 1: (1, 1, 1) } }",
     "inputs:exposure is float3, expected float; the value is ignored or read in part"},
    {"def Sphere \"S\" { double3 xformOp:translate = (1, 0, 0)\n token xformOpOrder = "
     "\"xformOp:translate\" }",
     "xformOpOrder is token, expected token[]"},
    {"def Sphere \"S\" { string visibility = \"inherited\"\n half radius = 0.5\n int doubleSided = "
     "1 }\ndef SphereLight \"L\" { float3 inputs:color = (1, 1, 1)\n asset inputs:radius = None }",
     nullptr},
    // Transforms
    {"def Sphere \"S\" { double3 xformOp:translate = (1, 0, 0)\n uniform token[] xformOpOrder = "
     "[\"xformOp:translate:pivot\", \"xformOp:translate\"] }",
     "xformOpOrder names xformOp:translate:pivot, which the prim does not have; the op is skipped "
     "[missing-xform-op]"},
    {"def Sphere \"S\" { double3 xformOp:translate = (1, 0, 0)\n uniform token[] xformOpOrder = "
     "[\"xformOp:transalte\"] }",
     "unknown transform op \"xformOp:transalte\""},
    {"def Sphere \"S\" { double3 xformOp:translate = (1, 0, 0) }",
     "xformOp:translate is not in xformOpOrder: it does not move the prim [unused-xform-op]"},
    // Other renderers
    {"def Sphere \"A\" { bool primvars:arnold:visibility:subsurface = 0 }\ndef Sphere \"B\" { bool "
     "primvars:arnold:visibility:subsurface = 0 }",
     "primvars:arnold:visibility:subsurface of Arnold is ignored: the prim is seen by all rays and "
     "casts shadows; primvars:velatura:visibility decides (2 prims, the first is named) "
     "[foreign-attribute]"},
    {"def Sphere \"A\" { bool primvars:vray:matte = 1 }", "primvars:vray:matte of V-Ray"},
    {"def Sphere \"A\" { int primvars:arnold:visibility:camera = 7 }",
     "primvars:arnold:visibility:camera is not 0 or 1; it is ignored [bad-visibility]"},
    {"def Sphere \"A\" { bool primvars:arnold:opaque = 0 }", "the opacity of the material decides"},
    {"def Sphere \"A\" { string karma:object:rendervisibility = \"-primary\" }",
     "karma:object:rendervisibility of Karma is ignored"},
    {"def Sphere \"A\" { int primvars:karma:object:holdoutmode = 2 }",
     "holdoutmode 2 (background) is not supported; the prim is a matte [bad-visibility]"},
    {"def RenderSettings \"R\" { int karma:global:samplesperpixel = 9 }",
     "karma:global:samplesperpixel of Karma is ignored: --spp, --adaptive and --target-error "
     "decide"},
    {"def Sphere \"A\" { int ri:attributes:visibility:camera = 0 }", "of RenderMan"},
    {"def Sphere \"A\" { int ri:attributes:Ri:Matte = 1 }", "of RenderMan is ignored"},
    {"def Sphere \"A\" { bool primvars:redshift:object:MESHFLAG_SHADOWCASTER = 0 }", "of Redshift"},
    {"def Sphere \"A\" { bool primvars:octane:object:is_shadow_catcher = 1 }", "of Octane"},
    {"def Sphere \"A\" { bool vray:object:matte_surface = 1 }", "of V-Ray"},
    // Schemas
    {"def Xform \"A\" (prepend apiSchemas = [\"GeomModelAPI\"]) { uniform token model:drawMode = "
     "\"cards\" }",
     "model:drawMode of GeomModelAPI is not supported: the geometry itself is rendered"},
    {"def GenerativeProcedural \"G\" { token proceduralSystem = \"x\" }",
     "proceduralSystem of GenerativeProcedural is not supported"},
    {"def ParticleField3DGaussianSplat \"G\" { point3f[] positions = [(0, 0, 0)] }",
     "ParticleField3DGaussianSplat is not supported, the prim is skipped"},
    // What says nothing of the image, or says what is done anyway
    {"def Sphere \"S\" { custom string userProperties:raduis = \"mine\"\n float primvars:rim = 1\n "
     "string note = \"a\"\n float3[] extentsHint = []\n bool primvars:arnold:matte = 0\n bool "
     "primvars:arnold:visibility:camera = 1\n string primvars:karma:object:rendervisibility = "
     "\"*\"\n "
     "int primvars:arnold:disp_padding = 0\n string houdini:editable = \"x\" }\ndef SphereLight "
     "\"L\" { string karma:light:lpetag = \"key\" }\ndef PhysicsScene \"P\" { float "
     "physics:gravityMagnitude = 9 }",
     nullptr},
};

/// Ends every statement before a brace that closes.
std::string with_ends(std::string prims) {
    for (size_t at = 0; (at = prims.find(" }", at)) != std::string::npos;) prims[at] = '\n';
    return prims;
}

}  // namespace

TEST(UnreadInput, IsNamedWithThePlaceAndWhatIsDone) {
    static_assert(std::size(cases) >= 40);
    Workplace w;
    for (const Case& c : cases) {
        w.write("s.usda",
                std::string("#usda 1.0\n") + (camera + 1) + "\n" + with_ends(c.prims) + "\n");
        const CommandResult r = w.velatura(
            "render s.usda -o s.exr --res 8 6 --spp 1 --layers none --guiding off --progress none");
        EXPECT_EQ(r.exit_code, 0) << c.prims << "\n" << r.output;
        EXPECT_TRUE(w.exists("s.exr")) << c.prims;
        const bool is_said =
            r.output.find(c.message != nullptr ? c.message : "warning") != std::string::npos;
        EXPECT_EQ(is_said, c.message != nullptr) << c.prims << "\n" << r.output;
    }
}

TEST(UnreadInput, MetadataOfTheStageIsChecked) {
    Workplace w;
    w.write("s.usda", std::string("#usda 1.0\n(\n    metersPerUnits = 1\n)\n") + camera);
    const CommandResult r = w.velatura(
        "render s.usda -o s.exr --res 8 6 --spp 1 --layers none --guiding off --progress none");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find("unknown metadata metersPerUnits of the stage (did you mean "
                            "'metersPerUnit'?); it is ignored [unknown-metadata]"),
              std::string::npos)
        << r.output;
}

/// A thousand prims with the same names are one line, and instances of one prototype are one prim.
TEST(UnreadInput, EveryNameIsListedOnce) {
    Workplace w;
    std::string usda = std::string("#usda 1.0\n") + camera;
    for (int i = 0; i < 1000; ++i)
        usda += "def Sphere \"S" + std::to_string(i) + "\" { double raduis = 2 }\n";
    for (int i = 0; i < 3; ++i)
        usda += "def Xform \"I" + std::to_string(i) +
                "\" (instanceable = true\n references = </P>) {}\n";
    usda += "class Xform \"P\" { def Cube \"C\" { double siz = 1 } }\n";
    w.write("s.usda", with_ends(usda));
    const CommandResult r = w.velatura(
        "render s.usda -o s.exr --res 8 6 --spp 1 --layers none --guiding off --progress none");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    size_t lines = 0;
    for (size_t at = 0; (at = r.output.find("[unknown-attribute]", at)) != std::string::npos; ++at)
        ++lines;
    EXPECT_EQ(lines, 2u) << r.output;
    EXPECT_NE(r.output.find("(1000 prims, the first is named)"), std::string::npos) << r.output;
}

}  // namespace velatura::test
