// SPDX-License-Identifier: Apache-2.0
// Attributes of skeletons, cameras, lights and settings, and what twins they have.
#include "schema_attributes.h"
#include "translate/color/blackbody.h"

#include <fmt/format.h>

namespace velatura::test {

namespace {

using Rows = std::vector<AttributeRow>;

const std::string square_of_mesh =
    "uniform token subdivisionScheme = \"none\"\nint[] faceVertexCounts = [4]\nint[] "
    "faceVertexIndices = [0, 1, 2, 3]\n";
const std::string square_points =
    "point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]\n";
const std::string no_dome = "@dark\n";

std::string mesh(const std::string& body) {
    return "def Mesh \"M\" {\n" + square_of_mesh + body + "\n}\n";
}

std::string matrix(double x, double y) {
    return fmt::format("((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), ({}, {}, 0, 1))", x, y);
}

const std::string turned_matrix = "((0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))";

/// A square that follows joints; each text may hold the `$`.
struct Puppet {
    std::string joints = "uniform token[] joints = [\"A\"]\n";
    std::string bind = "uniform matrix4d[] bindTransforms = [" + matrix(0, 0) + "]\n";
    std::string rest = "uniform matrix4d[] restTransforms = [" + matrix(0, 0) + "]\n";
    std::string animation = {};
    std::string indices =
        "int[] primvars:skel:jointIndices = [0] (elementSize = 1\n interpolation = \"constant\")\n";
    std::string weights =
        "float[] primvars:skel:jointWeights = [1] (elementSize = 1\n interpolation = "
        "\"constant\")\n";
    std::string binding = {};  ///< more lines of the mesh
    std::string points = square_points;

    std::string text() const {
        const std::string api = " (prepend apiSchemas = [\"SkelBindingAPI\"])";
        return "def SkelRoot \"R\"" + api + " {\nrel skel:skeleton = </R/K>\ndef Skeleton \"K\"" +
               api + " {\n" + joints + bind + rest + "rel skel:animationSource = </R/K/N>\n" +
               "def SkelAnimation \"N\" {\n" + animation + "}\n}\ndef Mesh \"M\"" + api + " {\n" +
               square_of_mesh + points + indices + weights + binding + "\n}\n}\n";
    }

    /// Two joints, the second of which moves to the right.
    static Puppet two() {
        Puppet p;
        p.joints = "uniform token[] joints = [\"A\", \"B\"]\n";
        p.bind =
            "uniform matrix4d[] bindTransforms = [" + matrix(0, 0) + ", " + matrix(0, 0) + "]\n";
        p.rest =
            "uniform matrix4d[] restTransforms = [" + matrix(0, 0) + ", " + matrix(1, 0) + "]\n";
        return p;
    }
};

std::string square_at(double x,
                      double y,
                      const std::string& turn = "0",
                      const std::string& scale = "1") {
    return "def Mesh \"M\" {\n" + square_of_mesh + square_points +
           fmt::format(
               "double3 xformOp:translate = ({}, {}, 0)\ndouble xformOp:rotateZ = {}\nfloat3 "
               "xformOp:scale = ({}, {}, {})\n",
               x, y, turn, scale, scale, scale) +
           "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:rotateZ\", "
           "\"xformOp:scale\"]\n}\n";
}

void add_joints(Rows& rows) {
    const std::string moved = square_at(1, 0);
    const auto add = [&](const char* schema, const char* attribute, const Puppet& p,
                         const std::string& authored, const std::string& twin) {
        rows.push_back({schema, attribute, p.text(), authored, twin});
    };
    Puppet p;
    p.rest = "uniform matrix4d[] restTransforms = [" + matrix(1, 0) + "]\n";
    p.joints = "$";
    add("Skeleton", "joints", p, "uniform token[] joints = [\"A\"]\n", moved);
    p = {};
    p.rest = "$";
    add("Skeleton", "restTransforms", p,
        "uniform matrix4d[] restTransforms = [" + matrix(1, 0) + "]\n", moved);
    p.rest = "uniform matrix4d[] restTransforms = [" + matrix(1, 0) + "]\n";
    p.bind = "$";
    add("Skeleton", "bindTransforms", p,
        "uniform matrix4d[] bindTransforms = [" + matrix(0, 1) + "]\n", square_at(1, -1));
    const std::string joints = "uniform token[] joints = [\"A\"]\n",
                      moves = "float3[] translations = [(1, 0, 0)]\n",
                      stays = "float3[] translations = [(0, 0, 0)]\n",
                      straight = "quatf[] rotations = [(1, 0, 0, 0)]\n",
                      whole = "half3[] scales = [(1, 1, 1)]\n";
    p = {};
    p.animation = "$" + moves + straight + whole;
    add("SkelAnimation", "joints", p, joints, moved);
    p.animation = joints + straight + whole + "$";
    add("SkelAnimation", "translations", p, moves, moved);
    p.animation = joints + stays + whole + "$";
    add("SkelAnimation", "rotations", p, "quatf[] rotations = [(0.92388, 0, 0, 0.382683)]\n",
        square_at(0, 0, "45"));
    p.animation = joints + stays + straight + "$";
    add("SkelAnimation", "scales", p, "half3[] scales = [(0.5, 0.5, 0.5)]\n",
        square_at(0, 0, "0", "0.5"));
    p = Puppet::two();
    p.binding = "$";
    add("SkelBindingAPI", "skel:joints", p, "uniform token[] skel:joints = [\"B\"]\n", moved);
    p = Puppet::two();
    p.indices = "$";
    add("SkelBindingAPI", "primvars:skel:jointIndices", p,
        "int[] primvars:skel:jointIndices = [1] (elementSize = 1\n interpolation = \"constant\")\n",
        moved);
    p.indices =
        "int[] primvars:skel:jointIndices = [1] (elementSize = 1\n interpolation = "
        "\"constant\")\n";
    p.weights = "$";
    add("SkelBindingAPI", "primvars:skel:jointWeights", p,
        "float[] primvars:skel:jointWeights = [1] (elementSize = 1\n interpolation = "
        "\"constant\")\n",
        moved);
    p = {};
    p.binding = "$";
    add("SkelBindingAPI", "primvars:skel:geomBindTransform", p,
        "matrix4d primvars:skel:geomBindTransform = " + matrix(1, 0) + "\n", moved);
    // Halfway between 0 and 90 degrees; the mean of the matrices would be smaller
    p = Puppet::two();
    p.rest = "uniform matrix4d[] restTransforms = [" + matrix(0, 0) + ", " + turned_matrix + "]\n";
    p.indices =
        "int[] primvars:skel:jointIndices = [0, 1, 0, 1, 0, 1, 0, 1] (elementSize = 2\n "
        "interpolation = \"vertex\")\n";
    p.weights =
        "float[] primvars:skel:jointWeights = [0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5] "
        "(elementSize = 2\n interpolation = \"vertex\")\n";
    p.binding = "$";
    add("SkelBindingAPI", "primvars:skel:skinningMethod", p,
        "uniform token primvars:skel:skinningMethod = \"dualQuaternion\"\n", square_at(0, 0, "45"));
}

void add_blend_shapes(Rows& rows) {
    const auto shape = [](const std::string& animation, const std::string& names,
                          const std::string& blend, const std::string& more = "") {
        Puppet p;
        p.animation = animation;
        p.binding = names + "rel skel:blendShapeTargets = </R/M/B>\n" + more +
                    "def BlendShape \"B\" {\n" + blend + "}\n";
        return p.text();
    };
    const std::string played = "uniform token[] blendShapes = [\"b\"]\n",
                      full = "float[] blendShapeWeights = [1]\n",
                      names = "uniform token[] skel:blendShapes = [\"b\"]\n",
                      offsets =
                          "uniform vector3f[] offsets = [(1, 0, 0), (1, 0, 0), (1, 0, 0), (1, "
                          "0, 0)]\n";
    const std::string moved = square_at(1, 0);
    rows.push_back(
        {"SkelAnimation", "blendShapes", shape(full + "$", names, offsets), played, moved});
    rows.push_back(
        {"SkelAnimation", "blendShapeWeights", shape(played + "$", names, offsets), full, moved});
    rows.push_back(
        {"SkelBindingAPI", "skel:blendShapes", shape(played + full, "$", offsets), names, moved});
    rows.push_back({"BlendShape", "offsets", shape(played + full, names, "$"), offsets, moved});
    rows.push_back({"BlendShape", "pointIndices",
                    shape(played + full, names, "uniform vector3f[] offsets = [(1, 1, 0)]\n$"),
                    "uniform int[] pointIndices = [2]\n",
                    mesh("point3f[] points = [(-1, -1, 0), (1, -1, 0), (2, 2, 0), (-1, 1, 0)]")});
    const std::string sun =
        no_dome +
        "def DistantLight \"Sun\" { float inputs:angle = 0\nfloat inputs:intensity = 3 }\n";
    const auto normals = [](const std::string& n) {
        return "normal3f[] normals = [" + n + ", " + n + ", " + n + ", " + n + "]\n";
    };
    rows.push_back(
        {"BlendShape", "normalOffsets",
         sun + shape(played + full, names,
                     "uniform vector3f[] offsets = [(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)]\n$",
                     normals("(0, 0, 1)")),
         "uniform vector3f[] normalOffsets = [(0.6, 0, -0.2), (0.6, 0, -0.2), (0.6, 0, -0.2), "
         "(0.6, "
         "0, -0.2)]\n",
         sun + mesh(square_points + normals("(0.6, 0, 0.8)"))});
}

}  // namespace

std::vector<AttributeRow> skeleton_rows() {
    Rows rows;
    add_joints(rows);
    add_blend_shapes(rows);
    return rows;
}

std::vector<AttributeRow> camera_rows() {
    Rows rows;
    const auto file = [](const std::string& camera, const std::string& prims,
                         const std::string& metadata = "", const std::string& light = "1") {
        return "#usda 1.0\n(" + metadata + ")\ndef Camera \"Cam\" {\n" + camera +
               "}\ndef DomeLight \"Sky\" { float inputs:intensity = " + light + " }\n" + prims;
    };
    const std::string far = at("(0, 0, 10)"), plane = "def Plane \"P\" {}\n";
    const auto add = [&](const char* attribute, const std::string& camera,
                         const std::string& authored, const std::string& twin,
                         const std::string& prims) {
        rows.push_back({"Camera", attribute, file(camera + "$", prims), authored, twin});
    };
    const std::string film = "float horizontalAperture = 40\nfloat verticalAperture = 30\n";
    // From very far away the view is parallel
    add("projection", far + film, "token projection = \"orthographic\"\n",
        file(at("(0, 0, 100000)") + film + "float focalLength = 1000000\n", "def Cube \"C\" {}\n"),
        "def Cube \"C\" {}\n");
    const std::string half_film = "float horizontalAperture = 20\nfloat verticalAperture = 15\n";
    const std::string wide = file(far + half_film + "float focalLength = 25\n", plane);
    add("horizontalAperture", far + "float verticalAperture = 15\n",
        "float horizontalAperture = 40\n", wide, plane);
    add("verticalAperture", far + "float horizontalAperture = 20\n",
        "float verticalAperture = 30\n", wide, plane);
    add("focalLength", far + half_film, "float focalLength = 25\n", file(far + film, plane), plane);
    // 5/50 of the distance
    add("horizontalApertureOffset", far, "float horizontalApertureOffset = 5\n",
        file(far, "def Plane \"P\" {\n" + at("(-1, 0, 0)") + "}\n"), plane);
    add("verticalApertureOffset", far, "float verticalApertureOffset = 2.5\n",
        file(far, "def Plane \"P\" {\n" + at("(0, -0.5, 0)") + "}\n"), plane);
    const std::string far_plane =
        "def Plane \"Q\" { double width = 9\ndouble length = 9\n" + at("(0, 0, -2)") + "}\n";
    add("clippingRange", far, "float2 clippingRange = (1, 11)\n", file(far, plane),
        plane + far_plane);
    // The same lens: its radius is a tenth of focalLength over two fStop
    const std::string twice_film =
        "float horizontalAperture = 41.91\nfloat verticalAperture = "
        "30.5816\nfloat focalLength = 100\n";
    add("fStop", far + "float focusDistance = 5\n", "float fStop = 2\n",
        file(far + twice_film + "float focusDistance = 5\nfloat fStop = 4\n", plane), plane);
    // Everything twice as large
    add("focusDistance", far + "float fStop = 2\n", "float focusDistance = 5\n",
        file(at("(0, 0, 20)") + twice_film + "float fStop = 2\nfloat focusDistance = 10\n",
             "def Plane \"P\" { double width = 4\ndouble length = 4 }\n"),
        plane);
    const std::string parallel = "token projection = \"orthographic\"\n";
    rows.push_back(
        {"Camera", "units",
         file(far + parallel + "float horizontalAperture = 4000\nfloat verticalAperture = 3000\n$",
              plane, "metersPerUnit = 1"),
         "token units = \"millimeters\"\n",
         file(far + parallel + film, plane, "metersPerUnit = 1")});
    const auto moving = [](const std::string& from, const std::string& to) {
        return "def Plane \"P\" {\ndouble3 xformOp:translate.timeSamples = { -1: (" + from +
               ", 0, 0), 0: (0, 0, 0), 1: (" + to +
               ", 0, 0) }\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n";
    };
    add("shutter:close", far, "double shutter:close = 1\n",
        file(far + "double shutter:close = 0.5\n", moving("0", "2")), moving("0", "1"));
    add("shutter:open", far, "double shutter:open = -1\n",
        file(far + "double shutter:open = -0.5\n", moving("-2", "0")), moving("-1", "0"));
    for (size_t i = rows.size() - 2; i < rows.size(); ++i) rows[i].tolerance = 2e-2;
    // Ref: UsdGeomCamera, Camera Exposure Model
    const auto brighter = [&](const char* attribute, const std::string& authored,
                              const std::string& light) {
        rows.push_back(
            {"Camera", attribute, file(far + "$", plane), authored, file(far, plane, "", light)});
    };
    brighter("exposure", "float exposure = 3\n", "8");
    brighter("exposure:time", "float exposure:time = 0.5\n", "0.5");
    brighter("exposure:iso", "float exposure:iso = 400\n", "4");
    brighter("exposure:fStop", "float exposure:fStop = 2\n", "0.25");
    brighter("exposure:responsivity", "float exposure:responsivity = 3\n", "3");
    return rows;
}

std::vector<AttributeRow> light_rows(const std::string& folder) {
    Rows rows;
    const std::string plane = "def Plane \"P\" { double width = 6\ndouble length = 6 }\n";
    const auto light = [](const std::string& type, const std::string& body,
                          const std::string& apis = "") {
        return no_dome + "def " + type + " \"L\"" +
               (apis.empty() ? "" : " (prepend apiSchemas = [" + apis + "])") + " {\n" + body +
               "\n}\n";
    };
    const std::string up = at("(0.5, 0, 2)");
    const auto rect = [&](const std::string& body) {
        return light("RectLight", up + body) + plane;
    };
    const auto add = [&](const char* schema, const char* attribute, const std::string& stage,
                         const std::string& authored, const std::string& twin) {
        rows.push_back({schema, attribute, stage, authored, twin});
    };
    add("LightAPI", "inputs:intensity", rect("$"), "float inputs:intensity = 4",
        rect("float inputs:exposure = 2"));
    add("LightAPI", "inputs:exposure", rect("$"), "float inputs:exposure = 2",
        rect("float inputs:intensity = 4"));
    add("LightAPI", "inputs:diffuse", rect("$"), "float inputs:diffuse = 0.5",
        rect("float inputs:intensity = 0.5"));
    add("LightAPI", "inputs:normalize", rect("float inputs:width = 2\n$"),
        "bool inputs:normalize = 1", rect("float inputs:width = 2\nfloat inputs:intensity = 0.5"));
    add("LightAPI", "inputs:color", rect("$"), "color3f inputs:color = (0.5, 0.25, 1)",
        light("RectLight", up) +
            "def Plane \"P\" { double width = 6\ndouble length = 6\ncolor3f[] "
            "primvars:displayColor = "
            "[(0.25, 0.125, 0.5)] }\n");
    const Vec3d warm = translate::color::blackbody_rgb(3000);
    const std::string warm_color =
        fmt::format("color3f inputs:color = ({:.9g}, {:.9g}, {:.9g})", warm.x, warm.y, warm.z);
    const std::string is_on = "bool inputs:enableColorTemperature = 1\n",
                      kelvin = "float inputs:colorTemperature = 3000\n";
    add("LightAPI", "inputs:enableColorTemperature", rect(kelvin + "$"), is_on, rect(warm_color));
    add("LightAPI", "inputs:colorTemperature", rect(is_on + "$"), kelvin, rect(warm_color));
    // Nothing but specular light
    const std::string mirror = R"usda(
def Plane "P" (prepend apiSchemas = ["MaterialBindingAPI"]) { double width = 6
    double length = 6
    rel material:binding = </Metal> }
def Material "Metal" {
    token outputs:surface.connect = </Metal/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.9, 0.9, 0.9)
        float inputs:metallic = 1
        token outputs:surface
    }
}
)usda";
    add("LightAPI", "inputs:specular", light("RectLight", up + "$") + mirror,
        "float inputs:specular = 0.5",
        light("RectLight", up + "float inputs:intensity = 0.5") + mirror);
    add("LightAPI", "collection:lightLink:includeRoot", rect("$"),
        "uniform bool collection:lightLink:includeRoot = 0", rect("float inputs:intensity = 0"));
    const std::string blocker = "def Cube \"B\" { double size = 0.4\n" + at("(0, 0, 1)") + "}\n";
    const auto shaded = [&](const std::string& body) {
        return light("RectLight", up + body, "\"ShadowAPI\"") + plane + blocker;
    };
    const std::string without = shaded("bool inputs:shadow:enable = 0");
    add("LightAPI", "collection:shadowLink:includeRoot", shaded("$"),
        "uniform bool collection:shadowLink:includeRoot = 0", without);
    add("ShadowAPI", "inputs:shadow:enable", shaded("$"), "bool inputs:shadow:enable = 0",
        shaded("uniform bool collection:shadowLink:includeRoot = 0"));
    add("ShadowAPI", "inputs:shadow:color", shaded("$"), "color3f inputs:shadow:color = (1, 1, 1)",
        without);
    add("ShadowAPI", "inputs:shadow:distance", shaded("$"), "float inputs:shadow:distance = 0.001",
        without);
    rows.back().tolerance = 2e-2;
    const auto read = [&](const char* schema, const char* attribute, const std::string& stage,
                          const std::string& authored, double value,
                          double (*number)(const scene::Light&), bool is_rendered = true) {
        AttributeRow row{schema, attribute, stage, authored};
        // The dome comes first or last: the light is the one that is none
        row.read = [number](const scene::Scene& s) {
            for (const scene::Light& l : s.lights)
                if (l.name != "/Sky") return number(l);
            return -1.0;
        };
        row.value = value;
        row.is_rendered = is_rendered;
        rows.push_back(row);
    };
    read("ShadowAPI", "inputs:shadow:falloff", shaded("float inputs:shadow:distance = 2\n$"),
         "float inputs:shadow:falloff = 1.5", 1.5,
         [](const scene::Light& l) { return double(l.links.shadow_falloff); });
    read("ShadowAPI", "inputs:shadow:falloffGamma",
         shaded("float inputs:shadow:distance = 2\nfloat inputs:shadow:falloff = 2\n$"),
         "float inputs:shadow:falloffGamma = 4", 4,
         [](const scene::Light& l) { return double(l.links.shadow_falloff_gamma); });
    const auto shaped = [&](const std::string& body) {
        return light("RectLight", up + body, "\"ShapingAPI\"") + plane;
    };
    read("ShapingAPI", "inputs:shaping:focus", shaped("$"), "float inputs:shaping:focus = 8", 8,
         [](const scene::Light& l) { return double(l.shaping.focus); });
    // A white tint takes from the focus what it does
    add("ShapingAPI", "inputs:shaping:focusTint", shaped("float inputs:shaping:focus = 8\n$"),
        "color3f inputs:shaping:focusTint = (1, 1, 1)", shaped(""));
    read("ShapingAPI", "inputs:shaping:cone:angle", shaped("$"),
         "float inputs:shaping:cone:angle = 20", 20,
         [](const scene::Light& l) { return double(l.shaping.cone_angle_deg); });
    read("ShapingAPI", "inputs:shaping:cone:softness",
         shaped("float inputs:shaping:cone:angle = 30\n$"),
         "float inputs:shaping:cone:softness = 0.75", 0.75,
         [](const scene::Light& l) { return double(l.shaping.cone_softness); });
    const std::string profile = "asset inputs:shaping:ies:file = @" + folder + "/lamp.ies@\n";
    read("ShapingAPI", "inputs:shaping:ies:file", shaped("$"), profile, 1,
         [](const scene::Light& l) { return l.shaping.ies ? 1.0 : 0.0; });
    read("ShapingAPI", "inputs:shaping:ies:angleScale", shaped(profile + "$"),
         "float inputs:shaping:ies:angleScale = 0.5", 0.5,
         [](const scene::Light& l) { return double(l.shaping.ies_angle_scale); });
    read("ShapingAPI", "inputs:shaping:ies:normalize", shaped(profile + "$"),
         "bool inputs:shaping:ies:normalize = 1", 1,
         [](const scene::Light& l) { return l.shaping.ies_normalize ? 1.0 : 0.0; });
    const auto filtered = [&](const std::string& body) {
        return light("RectLight", up + "rel light:filters = </F>\n") + plane +
               "def LightFilter \"F\" {\nfloat inputs:intensity = 0.5\n" + body + "\n}\n";
    };
    const std::string filter_id =
        "uniform token lightFilter:shaderId = \"PxrIntMultLightFilter\"\n";
    add("LightFilter", "lightFilter:shaderId", filtered("$"), filter_id,
        rect("float inputs:intensity = 0.5"));
    add("LightFilter", "collection:filterLink:includeRoot", filtered(filter_id + "$"),
        "uniform bool collection:filterLink:includeRoot = 0", rect(""));
    // Sizes, against scales
    const auto sized = [&](const char* type, const char* attribute, const std::string& authored,
                           const std::string& scale) {
        const std::string scaled =
            "double3 xformOp:translate = (0.5, 0, 2)\nfloat3 xformOp:scale = " + scale +
            "\nuniform token[] xformOpOrder = [\"xformOp:translate\", "
            "\"xformOp:scale\"]\n";
        add(type, attribute, light(type, up + "$") + plane, authored, light(type, scaled) + plane);
        rows.back().tolerance = 2e-2;
    };
    sized("RectLight", "inputs:width", "float inputs:width = 2", "(2, 1, 1)");
    sized("RectLight", "inputs:height", "float inputs:height = 2", "(1, 2, 1)");
    sized("DiskLight", "inputs:radius", "float inputs:radius = 1", "(2, 2, 2)");
    sized("SphereLight", "inputs:radius", "float inputs:radius = 1", "(2, 2, 2)");
    sized("CylinderLight", "inputs:radius", "float inputs:radius = 0.25", "(1, 0.5, 0.5)");
    sized("CylinderLight", "inputs:length", "float inputs:length = 2", "(2, 1, 1)");
    // Without a size a hint makes a point or line of it, as normalize does
    for (const auto& [type, hint] :
         {std::pair("SphereLight", "treatAsPoint"), std::pair("CylinderLight", "treatAsLine")})
        add(type, hint,
            light(type, up + "float inputs:radius = 0\nfloat inputs:intensity = 9\n$") + plane,
            "bool " + std::string(hint) + " = 1",
            light(type, up + "float inputs:radius = 0\nfloat inputs:intensity = 9\n"
                             "bool inputs:normalize = 1\n") +
                plane);
    // Irradiance π sin²(30°) on albedo 0.5
    AttributeRow angle{"DistantLight", "inputs:angle",
                       light("DistantLight", "float inputs:intensity = 1\n$") + plane,
                       "float inputs:angle = 60"};
    angle.middle = {0.125, 0.125, 0.125};
    angle.tolerance = 2e-2;
    rows.push_back(angle);
    add("DistantLight", "inputs:intensity", light("DistantLight", "$") + plane,
        "float inputs:intensity = 100000",
        light("DistantLight", "float inputs:exposure = 1") + plane);
    // Textures are read by a plugin (tests/lights, tests/plugin): here the scene is compared
    const std::string image = "asset inputs:texture:file = @picture.exr@\n";
    const auto has_file = [](const scene::Light& l) { return l.texture_file.empty() ? 0.0 : 1.0; };
    read("RectLight", "inputs:texture:file", rect("$"), image, 1, has_file, false);
    const auto dome = [](const std::string& type, const std::string& body) {
        return no_dome + "def " + type + " \"L\" {\n" + body + "\n}\ndef Sphere \"S\" {}\n";
    };
    for (const char* type : {"DomeLight", "DomeLight_1"}) {
        read(type, "inputs:texture:file", dome(type, "$"), image, 1, has_file, false);
        read(
            type, "inputs:texture:format", dome(type, image + "$"),
            "token inputs:texture:format = \"angular\"", double(scene::DomeFormat::Angular),
            [](const scene::Light& l) { return double(l.dome_format); }, false);
    }
    // The pole, y of the light, points to z
    read(
        "DomeLight_1", "poleAxis", dome("DomeLight_1", "$"), "uniform token poleAxis = \"Z\"", 1,
        [](const scene::Light& l) { return l.render_from_light[1][2]; }, false);
    // Portals guide and change no image
    const auto portal = [&](const std::string& body) {
        return dome("DomeLight", "rel portals = </W>") + "def PortalLight \"W\" {\n" + body +
               "\n}\n";
    };
    read(
        "PortalLight", "inputs:width", portal("$"), "float inputs:width = 3", 3,
        [](const scene::Light& l) { return l.render_from_portals.at(0)[0][0]; }, false);
    read(
        "PortalLight", "inputs:height", portal("$"), "float inputs:height = 3", 3,
        [](const scene::Light& l) { return l.render_from_portals.at(0)[1][1]; }, false);
    // What the camera sees of a light that glows green by its material and white as a light
    const auto lamp = [](const char* api, const std::string& body) {
        return no_dome + "def Sphere \"S\" (prepend apiSchemas = [\"" + api +
               "\", \"MaterialBindingAPI\"]) {\nrel material:binding = </Glow>\n" + body + "\n}\n" +
               R"usda(def Material "Glow" {
    token outputs:surface.connect = </Glow/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0, 0, 0)
        color3f inputs:emissiveColor = (0, 2, 0)
        token outputs:surface
    }
})usda";
    };
    AttributeRow sync{"LightAPI", "light:materialSyncMode", lamp("LightAPI", "$"),
                      "uniform token light:materialSyncMode = \"independent\""};
    sync.middle = {0, 2, 0};
    rows.push_back(sync);
    sync = {"MeshLightAPI", "light:materialSyncMode", lamp("MeshLightAPI", "$"),
            "uniform token light:materialSyncMode = \"noMaterialResponse\""};
    sync.middle = {1, 1, 1};
    rows.push_back(sync);
    return rows;
}

std::vector<AttributeRow> settings_rows() {
    Rows rows;
    const auto file = [](const std::string& settings, const std::string& prims) {
        return "#usda 1.0\n( renderSettingsPrimPath = \"/R\" )\ndef Camera \"Cam\" {\n" +
               at("(0, 0, 10)") + "}\ndef DomeLight \"Sky\" {}\ndef RenderSettings \"R\" {\n" +
               settings + "\n}\n" + prims;
    };
    const std::string ball = "def Sphere \"S\" {}\n";
    const auto read = [&](const char* schema, const char* attribute, const std::string& stage,
                          const std::string& authored, double value,
                          std::function<double(const scene::Scene&)> number) {
        AttributeRow row{schema, attribute, stage, authored};
        row.read = std::move(number);
        row.value = value;
        row.is_rendered = false;
        rows.push_back(row);
    };
    const auto base = [&](const char* attribute, const std::string& authored, double value,
                          double (*number)(const scene::RenderSettings&)) {
        read("RenderSettingsBase", attribute, file("$", ball), authored, value,
             [number](const scene::Scene& s) { return number(s.settings); });
    };
    using S = scene::RenderSettings;
    base("resolution", "uniform int2 resolution = (20, 10)", 20,
         [](const S& s) { return double(s.width); });
    base("pixelAspectRatio", "uniform float pixelAspectRatio = 2", 2,
         [](const S& s) { return s.pixel_aspect_ratio; });
    base("dataWindowNDC", "uniform float4 dataWindowNDC = (0.25, 0, 1, 1)", 0.25,
         [](const S& s) { return s.data_window_ndc[0]; });
    base("disableMotionBlur", "uniform bool disableMotionBlur = 1", 1,
         [](const S& s) { return s.disable_motion_blur ? 1.0 : 0.0; });
    base("instantaneousShutter", "uniform bool instantaneousShutter = 1", 1,
         [](const S& s) { return s.disable_motion_blur ? 1.0 : 0.0; });
    base("disableDepthOfField", "uniform bool disableDepthOfField = 1", 1,
         [](const S& s) { return s.disable_depth_of_field ? 1.0 : 0.0; });
    // 2048 × 1080 pixels are wider than the film of 20.955 × 15.2908: cropping keeps the width
    read("RenderSettingsBase", "aspectRatioConformPolicy", file("$", ball),
         "uniform token aspectRatioConformPolicy = \"cropAperture\"", 20.955 / 50 / 2,
         [](const scene::Scene& s) { return s.camera.window_right; });
    // What it changes is tested color by color (translate/color/working_space_test.cpp)
    read("RenderSettings", "renderingColorSpace", file("$", ball),
         "uniform token renderingColorSpace = \"lin_ap1_scene\"", 1, [](const scene::Scene& s) {
             return s.settings.working_space == "lin_ap1_scene" ? 1.0 : 0.0;
         });
    const std::string guide = "def Sphere \"S\" { uniform token purpose = \"guide\" }\n";
    rows.push_back({"RenderSettings", "includedPurposes", file("$", guide),
                    "uniform token[] includedPurposes = [\"default\", \"guide\"]", file("", ball)});
    const auto bound = [](const std::string& relation) {
        std::string text = "def Sphere \"S\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) {\n" +
                           relation + "\n}\n";
        for (const char* name : {"Full", "Preview"})
            text += fmt::format(
                "def Material \"{0}\" {{ token outputs:surface.connect = "
                "</{0}/S.outputs:surface>\n def Shader \"S\" {{ uniform token info:id "
                "= \"UsdPreviewSurface\"\n color3f inputs:diffuseColor = ({1}, 0.5, "
                "0.1)\n token outputs:surface }} }}\n",
                name, name[0] == 'F' ? "0.1" : "0.9");
        return text;
    };
    rows.push_back({"RenderSettings", "materialBindingPurposes",
                    file("$", bound("rel material:binding:full = </Full>\nrel "
                                    "material:binding:preview = </Preview>")),
                    "uniform token[] materialBindingPurposes = [\"preview\", \"\"]",
                    file("", bound("rel material:binding = </Preview>"))});
    for (const char* purpose : {"guide", "proxy", "render"}) {
        const std::string name = std::string(purpose) + "Visibility";
        const auto shown = [&](const std::string& body) {
            return file(
                "uniform token[] includedPurposes = [\"default\", \"guide\", \"proxy\", "
                "\"render\"]",
                "def Xform \"X\" (prepend apiSchemas = [\"VisibilityAPI\"]) {\n" + body +
                    "\ndef Sphere \"S\" { uniform token purpose = \"" + purpose + "\" } }\n");
        };
        rows.push_back({"VisibilityAPI", name, shown("$"),
                        "uniform token " + name + " = \"invisible\"",
                        shown("token visibility = \"invisible\"")});
    }
    const auto product = [&](const std::string& body, const std::string& var) {
        return file("rel products = </P>",
                    ball + "def RenderProduct \"P\" {\nrel orderedVars = </V>\n" + body +
                        "}\ndef RenderVar \"V\" {\n" + var + "}\n");
    };
    read("RenderProduct", "productName", product("$", ""), "token productName = \"out.exr\"\n", 1,
         [](const scene::Scene& s) {
             return s.settings.products.at(0).name == "out.exr" ? 1.0 : 0.0;
         });
    read("RenderVar", "sourceName", product("", "$"), "uniform string sourceName = \"Z\"\n", 1,
         [](const scene::Scene& s) {
             return s.settings.products.at(0).vars.at(0).source_name == "Z" ? 1.0 : 0.0;
         });
    read("RenderVar", "sourceType", product("", "$"), "uniform token sourceType = \"lpe\"\n", 1,
         [](const scene::Scene& s) {
             return s.settings.products.at(0).vars.at(0).source_type == "lpe" ? 1.0 : 0.0;
         });
    read("RenderVar", "dataType", product("", "$"), "uniform token dataType = \"half3\"\n", 1,
         [](const scene::Scene& s) {
             return s.settings.products.at(0).vars.at(0).data_type == "half3" ? 1.0 : 0.0;
         });
    AttributeRow pass{
        "RenderPass", "collection:renderVisibility:includeRoot",
        file("", ball + "def RenderPass \"Pass\" { rel renderSource = </R>\n$ }\n"),
        "uniform bool collection:renderVisibility:includeRoot = 0",
        "@dark\ndef RenderPass \"Pass\" { rel renderSource = </R> }\ndef RenderSettings "
        "\"R\" {}\n"};
    pass.settings = "/Pass";
    rows.push_back(pass);
    pass.attribute = "collection:cameraVisibility:includeRoot";
    pass.authored = "uniform bool collection:cameraVisibility:includeRoot = 0";
    rows.push_back(pass);
    // Grids are read by a plugin: tests/volume
    const auto volume = [](const std::string& body) {
        return "def Volume \"V\" { rel field:density = </V/D>\ndef OpenVDBAsset \"D\" {\n" + body +
               "\n} }\n";
    };
    const std::string named = "token fieldName = \"smoke\"\n";
    const auto field = [](const scene::Scene& s) {
        return s.volume_fields.empty() ? scene::VolumeField() : s.volume_fields.back();
    };
    read("OpenVDBAsset", "filePath", volume(named + "$"), "asset filePath = @fire.vdb@\n", 1,
         [field](const scene::Scene& s) { return field(s).authored == "fire.vdb" ? 1.0 : 0.0; });
    const std::string from = "asset filePath = @fire.vdb@\n";
    read("OpenVDBAsset", "fieldName", volume(from + "$"), named, 1,
         [field](const scene::Scene& s) { return field(s).grid == "smoke" ? 1.0 : 0.0; });
    read("OpenVDBAsset", "fieldIndex", volume(from + named + "$"), "int fieldIndex = 2", 2,
         [field](const scene::Scene& s) { return double(field(s).index); });
    read("OpenVDBAsset", "fieldClass", volume(from + named + "$"),
         "token fieldClass = \"levelSet\"", double(scene::GridKind::LevelSet),
         [field](const scene::Scene& s) { return double(field(s).kind); });
    return rows;
}

}  // namespace velatura::test
