// SPDX-License-Identifier: Apache-2.0
// Inputs of shader nodes and what twins they have.
#include "schema_attributes.h"

#include <fmt/format.h>

#include <fstream>

namespace velatura::test {

namespace {

using Rows = std::vector<AttributeRow>;

/// A square with texture coordinates and a primvar, and its material; each part may hold the `$`.
std::string square(const std::string& shader,
                   const std::string& nodes = "",
                   const std::string& interface = "",
                   const std::string& primvars = "") {
    return R"usda(
def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
    rel material:binding = </Mat>
)usda" + primvars +
           R"usda(
}
def Material "Mat" {
    token outputs:surface.connect = </Mat/S.outputs:surface>
)usda" + interface +
           R"usda(
    def Shader "S" {
        token outputs:surface
)usda" + shader +
           "\n}\n" + nodes + "\n}\n";
}

const std::string preview = "uniform token info:id = \"UsdPreviewSurface\"\n";
/// Black but for what it emits, seen straight on, where it reflects nothing.
const std::string glowing =
    preview +
    "color3f inputs:diffuseColor = (0, 0, 0)\nint "
    "inputs:useSpecularWorkflow = 1\ncolor3f inputs:emissiveColor.connect = ";

AttributeRow middle(const char* schema,
                    const char* attribute,
                    const std::string& stage,
                    const std::string& authored,
                    std::vector<double> rgb) {
    AttributeRow row{schema, attribute, "@dark\n" + stage, authored};
    row.middle = std::move(rgb);
    row.tolerance = 5e-3;
    return row;
}

/// The same value by way of the material's interface.
void add_surface(Rows& rows) {
    struct Case {
        const char* type;
        const char* name;
        const char* value;
        const char* beside;
    };

    const Case cases[] = {
        {"color3f", "diffuseColor", "(0.8, 0.3, 0.1)", ""},
        {"color3f", "emissiveColor", "(0.5, 0, 2)", ""},
        {"int", "useSpecularWorkflow", "1", "color3f inputs:specularColor = (0.8, 0.8, 0.1)\n"},
        {"color3f", "specularColor", "(0.8, 0.8, 0.1)", "int inputs:useSpecularWorkflow = 1\n"},
        {"float", "metallic", "1", ""},
        {"float", "roughness", "0.1", "float inputs:metallic = 1\n"},
        {"float", "clearcoat", "1", ""},
        {"float", "clearcoatRoughness", "0.8", "float inputs:clearcoat = 1\n"},
        {"float", "opacity", "0.25", ""},
        {"float", "opacityThreshold", "0.5", "float inputs:opacity = 0.25\n"},
        {"token", "opacityMode", "\"presence\"", "float inputs:opacity = 0.25\n"},
        {"float", "ior", "2.5", ""},
        {"normal3f", "normal", "(0.6, 0, 0.8)", ""},
    };
    const std::string lamp =
        "def SphereLight \"L\" { float inputs:intensity = 6\nfloat inputs:radius = "
        "0.6\n" +
        at("(1, 1, 2.5)") + "}\n";
    for (const Case& c : cases) {
        const std::string name = c.name, input = fmt::format("{} inputs:{}", c.type, name);
        AttributeRow row{
            "UsdPreviewSurface", "inputs:" + name, lamp + square(preview + c.beside + "$"),
            fmt::format("{} = {}", input, c.value),
            lamp + square(preview + c.beside + fmt::format("{}.connect = </Mat.inputs:own>", input),
                          "", fmt::format("{} inputs:own = {}\n", c.type, c.value))};
        rows.push_back(row);
    }
    // What moves by it are subdivided meshes: tests/subdivision
    AttributeRow displacement{
        "UsdPreviewSurface", "inputs:displacement",
        square(preview + "token outputs:displacement\n$", "",
               "token outputs:displacement.connect = </Mat/S.outputs:displacement>\n"),
        "float inputs:displacement = 0.25"};
    displacement.read = [](const scene::Scene& s) {
        return double(s.materials.at(size_t(s.shapes.at(0).material)).displacement.value.x);
    };
    displacement.value = 0.25;
    displacement.is_rendered = false;
    rows.push_back(displacement);
    rows.push_back(middle("Shader", "info:id",
                          square("color3f inputs:diffuseColor = (0, 0, 0)\nint "
                                 "inputs:useSpecularWorkflow = 1\ncolor3f inputs:emissiveColor = "
                                 "(0.5, 1, 2)\n$"),
                          preview, {0.5, 1, 2}));
}

/// Where on the texture the constant coordinates end up.
Vec2 looked_up(const scene::Texture& t) {
    const auto& m = t.st_matrix;
    return Vec2(t.st_constant.x * m[0] + t.st_constant.y * m[2],
                t.st_constant.x * m[1] + t.st_constant.y * m[3]) +
           t.st_offset;
}

/// Texels are read by a plugin (tests/shading, tests/plugin): here the scene is compared.
void add_textures(Rows& rows) {
    const auto glow = [](const std::string& body, const std::string& more = "") {
        return square(glowing + "</Mat/T.outputs:rgb>\n",
                      "def Shader \"T\" { uniform token info:id = \"UsdUVTexture\"\ntoken "
                      "outputs:rgb\n" +
                          body + "\n}\n" + more);
    };
    const auto add = [&](const char* schema, const char* attribute, const std::string& stage,
                         const std::string& authored, double value,
                         double (*read)(const scene::Texture&)) {
        AttributeRow row{schema, attribute, stage, authored};
        row.read = [read](const scene::Scene& s) {
            return s.textures.empty() ? -9.0 : read(s.textures[0]);
        };
        row.value = value;
        row.is_rendered = false;
        rows.push_back(row);
    };
    const std::string file = "asset inputs:file = @picture.exr@\n";
    const auto of_texture = [&](const char* attribute, const std::string& authored, double value,
                                double (*read)(const scene::Texture&)) {
        add("UsdUVTexture", attribute, glow(file + "$"), authored, value, read);
    };
    using T = scene::Texture;
    add("UsdUVTexture", "inputs:file", glow("$"), file, 1,
        [](const T& t) { return t.authored == "picture.exr" ? 1.0 : 0.0; });
    rows.push_back(middle("UsdUVTexture", "inputs:fallback", glow("$"),
                          "float4 inputs:fallback = (0.1, 0.3, 0.7, 1)", {0.1, 0.3, 0.7}));
    of_texture("inputs:scale", "float4 inputs:scale = (2, 1, 0.5, 1)", 2,
               [](const T& t) { return double(t.scale[0]); });
    of_texture("inputs:bias", "float4 inputs:bias = (0.25, 0, 0.2, 0)", 0.25,
               [](const T& t) { return double(t.bias[0]); });
    of_texture("inputs:sourceColorSpace", "token inputs:sourceColorSpace = \"sRGB\"", 1,
               [](const T& t) { return t.colors.curve == T().colors.curve ? 0.0 : 1.0; });
    of_texture("inputs:st", "float2 inputs:st = (0.625, 0.5)", 0.625,
               [](const T& t) { return double(looked_up(t).x); });
    of_texture("inputs:wrapS", "token inputs:wrapS = \"repeat\"", double(scene::Wrap::Repeat),
               [](const T& t) { return double(t.wrap_s); });
    of_texture("inputs:wrapT", "token inputs:wrapT = \"mirror\"", double(scene::Wrap::Mirror),
               [](const T& t) { return double(t.wrap_t); });
    const auto turned = [&](const char* attribute, const std::string& body,
                            const std::string& authored, double value) {
        const std::string node =
            "def Shader \"X\" { uniform token info:id = \"UsdTransform2d\"\nfloat2 "
            "outputs:result\n" +
            body + "$\n}\n";
        add("UsdTransform2d", attribute,
            glow(file + "float2 inputs:st.connect = </Mat/X.outputs:result>\n", node), authored,
            value, [](const T& t) { return double(looked_up(t).x); });
    };
    const std::string in = "float2 inputs:in = (0.125, 0.5)\n";
    turned("inputs:in", "", "float2 inputs:in = (0.625, 0.5)", 0.625);
    turned("inputs:translation", in, "float2 inputs:translation = (0.25, 0)", 0.375);
    turned("inputs:scale", in, "float2 inputs:scale = (3, 1)", 0.375);
    // A quarter turn counterclockwise leads (x, y) to (-y, x)
    turned("inputs:rotation", in, "float inputs:rotation = 90", -0.5);
    // The primvar that the coordinates come from, and what stands in for it
    const auto coordinates = [&](const std::string& body) {
        return glow(
            file + "float2 inputs:st.connect = </Mat/P.outputs:result>\n",
            "def Shader \"P\" { uniform token info:id = \"UsdPrimvarReader_float2\"\nfloat2 "
            "outputs:result\n" +
                body + "\n}\n");
    };
    add("UsdPrimvarReader_float2", "inputs:varname", coordinates("$"),
        "string inputs:varname = \"st\"", 1,
        [](const T& t) { return t.st == scene::none ? 0.0 : 1.0; });
    add("UsdPrimvarReader_float2", "inputs:fallback",
        coordinates("string inputs:varname = \"nobody\"\n$"),
        "float2 inputs:fallback = (0.625, 0.5)", 0.625,
        [](const T& t) { return double(looked_up(t).x); });
}

void add_readers(Rows& rows) {
    struct Case {
        const char* node;
        const char* type;  ///< of the primvar and the fallback
        const char* value;
        std::vector<double> rgb;
    };

    const Case cases[] = {
        {"float3", "float3", "(0.3, 0.6, 0.9)", {0.3, 0.6, 0.9}},
        {"float4", "float4", "(0.3, 0.6, 0.9, 1)", {0.3, 0.6, 0.9}},
        {"vector", "vector3f", "(0.3, 0.6, 0.9)", {0.3, 0.6, 0.9}},
        {"normal", "normal3f", "(0.3, 0.6, 0.9)", {0.3, 0.6, 0.9}},
        {"point", "point3f", "(0.3, 0.6, 0.9)", {0.3, 0.6, 0.9}},
    };
    for (const Case& c : cases) {
        const std::string id = std::string("UsdPrimvarReader_") + c.node;
        const auto stage = [&](const std::string& body) {
            return square(glowing + "</Mat/T.outputs:result>\n",
                          fmt::format("def Shader \"T\" {{ uniform token info:id = \"{}\"\n{} "
                                      "outputs:result\n{} }}\n",
                                      id, c.type, body),
                          "", fmt::format("{} primvars:own = {}\n", c.type, c.value));
        };
        rows.push_back(
            middle("", "inputs:varname", stage("$"), "string inputs:varname = \"own\"", c.rgb));
        rows.back().schema = id;
        rows.push_back(middle("", "inputs:fallback", stage("string inputs:varname = \"nobody\"\n$"),
                              fmt::format("{} inputs:fallback = {}", c.type, c.value), c.rgb));
        rows.back().schema = id;
    }
    // Numbers, at an input that is one
    for (const std::string type : {"float", "int"}) {
        const std::string id = "UsdPrimvarReader_" + type;
        const auto add = [&](const char* attribute, const std::string& body,
                             const std::string& authored,
                             std::function<double(const scene::Input&)> read) {
            AttributeRow row{
                id, attribute,
                square(preview + "float inputs:metallic.connect = </Mat/T.outputs:result>\n",
                       fmt::format("def Shader \"T\" {{ uniform token info:id = "
                                   "\"{}\"\n{} outputs:result\n{} }}\n",
                                   id, type, body),
                       "", type + " primvars:own = 1\n"),
                authored};
            row.read = [read](const scene::Scene& s) {
                return read(s.materials.at(size_t(s.shapes.at(0).material)).metallic);
            };
            row.value = 1;
            rows.push_back(row);
            // The same by the material's interface
            rows.back().twin =
                square(preview + "float inputs:metallic.connect = </Mat.inputs:own>\n", "",
                       "float inputs:own = 1\n");
        };
        add("inputs:varname", "$", "string inputs:varname = \"own\"", [](const scene::Input& i) {
            return i.source == scene::Input::Source::Primvar ? 1.0 : 0.0;
        });
        add("inputs:fallback", "string inputs:varname = \"nobody\"\n$",
            type + " inputs:fallback = 1", [](const scene::Input& i) { return double(i.value.x); });
    }
}

}  // namespace

void write_lamp(const std::string& folder) {
    std::ofstream(folder + "/lamp.ies")
        << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 90 180\n0\n3 1 0.5\n";
}

std::vector<AttributeRow> material_rows() {
    Rows rows;
    add_surface(rows);
    add_textures(rows);
    add_readers(rows);
    return rows;
}

}  // namespace velatura::test
