// SPDX-License-Identifier: Apache-2.0
#include "random_scene.h"

#include <fmt/format.h>

#include <cmath>
#include <initializer_list>
#include <random>
#include <string_view>

namespace velatura::test {

namespace {

/// Draws and writes. The engine is the standard's, the distributions are not: they differ from
/// library to library.
class StageWriter {
  public:
    explicit StageWriter(uint64_t seed) : random_(seed) {}

    std::string write() {
        add("#usda 1.0\n(\n upAxis = \"Y\"\n timeCodesPerSecond = 24\n)\n");
        add_camera();
        const int materials = 1 + below(4);
        for (materials_ = 0; materials_ < materials; ++materials_)
            add_material(fmt::format("Mat{}", materials_));
        add("def Mesh \"Floor\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) {\n int[] "
            "faceVertexCounts = [4]\n int[] faceVertexIndices = [0, 1, 2, 3]\n"
            " point3f[] points = [(-4, 0, 4), (4, 0, 4), (4, 0, -4), (-4, 0, -4)]\n uniform token "
            "subdivisionScheme = \"none\"\n");
        add_binding();
        add("}\n");
        const int shapes = 1 + below(5);
        for (int i = 0; i < shapes; ++i) add_shape(fmt::format("Shape{}", i), Place::World);
        if (chance(0.4)) add_native_instances();
        if (chance(0.25)) add_point_instancer();
        if (chance(0.15)) add_volume();
        const int lights = below(4);
        for (int i = 0; i < lights; ++i) add_light(fmt::format("Light{}", i));
        return std::move(text_);
    }

  private:
    enum class Place { World, Prototype };

    void add(std::string_view text) { text_ += text; }

    double unit() { return double(random_() >> 11) * 0x1p-53; }

    double between(double low, double high) { return low + (high - low) * unit(); }

    int below(int count) { return int(random_() % uint64_t(count)); }

    bool chance(double share) { return unit() < share; }

    std::string_view one_of(std::initializer_list<std::string_view> all) {
        return all.begin()[below(int(all.size()))];
    }

    double one_of_numbers(std::initializer_list<double> all) {
        return all.begin()[below(int(all.size()))];
    }

    /// In [0, 1]; the ends as often as what is between.
    double share() { return chance(0.5) ? unit() : one_of_numbers({0, 1, 1e-4, 0.999}); }

    std::string color(double max = 1.0) {
        const double gray = share() * max;
        if (chance(0.3)) return fmt::format("({0}, {0}, {0})", gray);
        return fmt::format("({}, {}, {})", share() * max, share() * max, share() * max);
    }

    std::string vector(double low, double high) {
        return fmt::format("({}, {}, {})", between(low, high), between(low, high),
                           between(low, high));
    }

    /// Of a prim that stands at about `around`.
    void add_placement(std::string_view around, double spread) {
        add(fmt::format(" double3 xformOp:translate = {}\n", around));
        std::string order = "\"xformOp:translate\"";
        if (chance(0.5)) {
            add(fmt::format(" float3 xformOp:rotateXYZ = {}\n", vector(-180, 180)));
            order += ", \"xformOp:rotateXYZ\"";
        }
        if (chance(0.2)) {
            add(fmt::format(" float xformOp:rotateY:spin.timeSamples = {{ 0: {}, 1: {} }}\n",
                            between(-90, 90), between(-90, 90)));
            order += ", \"xformOp:rotateY:spin\"";
        }
        if (chance(0.3)) {
            const double sign = chance(0.3) ? -1 : 1;
            add(fmt::format(" float3 xformOp:scale = ({}, {}, {})\n", sign * between(0.2, spread),
                            between(0.2, spread), chance(0.1) ? 1e-3 : between(0.2, spread)));
            order += ", \"xformOp:scale\"";
        }
        add(fmt::format(" uniform token[] xformOpOrder = [{}]\n", order));
    }

    std::string spot() {
        return fmt::format("({}, {}, {})", between(-2, 2), between(0, 2), between(-2, 1.5));
    }

    void add_camera() {
        add("def Camera \"Cam\" {\n");
        if (chance(0.15))
            add(" token projection = \"orthographic\"\n float horizontalAperture = 60\n float "
                "verticalAperture = 45\n");
        add(fmt::format(" float focalLength = {}\n float2 clippingRange = ({}, 10000)\n",
                        between(12, 50), one_of_numbers({0, 0.01, 3})));
        if (chance(0.3))
            add(fmt::format(" float fStop = {}\n float focusDistance = {}\n",
                            one_of_numbers({0, 0.1, 2.8}), one_of_numbers({0, 3, 5, 1e6})));
        if (chance(0.5))
            add(fmt::format(" double shutter:open = 0\n double shutter:close = {}\n",
                            one_of_numbers({0, 0.5, 1})));
        // Within something now and then
        const double z = chance(0.15) ? between(-1, 1) : 5.0;
        if (chance(0.2))
            add(fmt::format(
                " double3 xformOp:translate.timeSamples = {{ 0: (0, 1, {}), 1: ({}, 1.2, {}) }}\n",
                z, between(-0.5, 0.5), z));
        else
            add(fmt::format(" double3 xformOp:translate = (0, 1, {})\n", z));
        add(" uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n");
    }

    void add_input(std::string_view type,
                   std::string_view name,
                   std::string_view value,
                   double how_often) {
        if (chance(how_often)) add(fmt::format(" {} inputs:{} = {}\n", type, name, value));
    }

    void add_share(std::string_view name, double how_often) {
        add_input("float", name, fmt::format("{}", share()), how_often);
    }

    void add_material(const std::string& name) {
        add(fmt::format(
            "def Material \"{}\" {{\n token outputs:surface.connect = </{}/S.outputs:surface>\n",
            name, name));
        const double kind = unit();
        if (kind < 0.15)
            add_node_surface(name);
        else if (kind < 0.2)
            add(
                fmt::format(" def Shader \"S\" {{\n uniform token info:id = \"VelaturaHair\"\n "
                            "color3f inputs:color = {}\n token outputs:surface\n }}\n",
                            color()));
        else
            add_preview_surface(name);
        add("}\n");
    }

    void add_preview_surface(const std::string& name) {
        add(" def Shader \"S\" {\n uniform token info:id = \"UsdPreviewSurface\"\n token "
            "outputs:surface\n");
        add_input("color3f", "diffuseColor", color(), 0.9);
        add_share("metallic", 0.3);
        if (chance(0.15))
            add(fmt::format(" float inputs:roughness.connect = </{}/Reader.outputs:result>\n",
                            name));
        else
            add_share("roughness", 0.8);
        add_input("float", "ior", fmt::format("{}", one_of_numbers({1, 1.0001, 1.33, 1.5, 2.5})),
                  0.5);
        if (chance(0.1))
            add(fmt::format(
                " int inputs:useSpecularWorkflow = 1\n color3f inputs:specularColor = {}\n",
                color()));
        if (chance(0.25))
            add(fmt::format(" float inputs:clearcoat = {}\n float inputs:clearcoatRoughness = {}\n",
                            share(), share()));
        add_share("opacity", 0.4);
        add_input("token", "opacityMode", "\"presence\"", 0.15);
        add_input("float", "opacityThreshold", fmt::format("{}", one_of_numbers({0, 0.3, 1})),
                  0.15);
        add_input("normal3f", "normal",
                  fmt::format("({}, {}, 1)", between(-0.5, 0.5), between(-0.5, 0.5)), 0.15);
        add_input("color3f", "emissiveColor", color(chance(0.5) ? 0.0 : 5.0), 0.15);
        add_share("velatura:anisotropy", 0.15);
        add_input("bool", "velatura:thinWalled", "1", 0.15);
        add_input("bool", "velatura:roughTransmission", "1", 0.2);
        add_share("velatura:diffuseTransmission", 0.15);
        if (chance(0.2))
            add(
                fmt::format(" float inputs:velatura:transmissionDepth = {}\n color3f "
                            "inputs:velatura:transmissionColor = {}\n",
                            one_of_numbers({0, 0.1, 2}), color()));
        add_input("int", "velatura:dielectricPriority", fmt::format("{}", below(4) - 1), 0.15);
        if (chance(0.12))
            add(
                fmt::format(" float inputs:velatura:subsurface = {}\n color3f "
                            "inputs:velatura:subsurfaceRadius = {}\n",
                            share(), vector(0.01, 0.5)));
        add(
            fmt::format(" }}\n def Shader \"Reader\" {{\n uniform token info:id = "
                        "\"UsdPrimvarReader_float\"\n string inputs:varname = \"amount\"\n float "
                        "inputs:fallback = {}\n float outputs:result\n }}\n",
                        share()));
    }

    void add_node_surface(const std::string& name) {
        add(" def Shader \"S\" {\n uniform token info:id = \"ND_standard_surface_surfaceshader\"\n "
            "token outputs:surface\n");
        add_input("color3f", "base_color", color(), 0.5);
        if (chance(0.4))
            add(fmt::format(" color3f inputs:specular_color.connect = </{}/N.outputs:out>\n",
                            name));
        add_share("base", 0.5);
        add_share("diffuse_roughness", 0.4);
        add_share("sheen", 0.5);
        add_share("sheen_roughness", 0.3);
        add_share("coat", 0.3);
        add_share("specular_roughness", 0.6);
        add_share("metalness", 0.2);
        add_share("transmission", 0.2);
        if (chance(0.3))
            add(fmt::format(" float inputs:thin_film_thickness = {}\n", between(0, 900)));
        if (chance(0.3))
            add(fmt::format(" float inputs:transmission_dispersion = {}\n", between(9, 60)));
        add(
            fmt::format(" }}\n def Shader \"N\" {{\n uniform token info:id = \"{}\"\n color3f "
                        "outputs:out\n }}\n",
                        one_of({"ND_ramplr_color3", "ND_noise3d_color3", "ND_fractal3d_color3"})));
    }

    void add_binding() {
        if (chance(0.85)) add(fmt::format(" rel material:binding = </Mat{}>\n", below(materials_)));
        if (chance(0.3)) add(fmt::format(" color3f[] primvars:displayColor = [{}]\n", color()));
        if (chance(0.05)) add(fmt::format(" float[] primvars:displayOpacity = [{}]\n", share()));
        if (chance(0.3)) add(fmt::format(" float primvars:amount = {}\n", share()));
        if (chance(0.2)) add(" uniform bool doubleSided = 1\n");
        if (chance(0.1)) add(" uniform token orientation = \"leftHanded\"\n");
    }

    void add_shape(const std::string& name, Place place) {
        const std::string_view type =
            one_of({"Cube", "Sphere", "Cylinder", "Cone", "Capsule", "Plane", "Mesh", "Mesh",
                    "Mesh", "BasisCurves", "Points"});
        const bool shines = place == Place::World && chance(0.06) &&
                            (type == "Cube" || type == "Mesh" || type == "Sphere");
        add(fmt::format("def {} \"{}\" (prepend apiSchemas = [\"MaterialBindingAPI\"{}]) {{\n",
                        type, name, shines ? ", \"LightAPI\"" : ""));
        if (shines)
            add(fmt::format(
                " float inputs:intensity = {}\n token light:materialSyncMode = \"{}\"\n",
                one_of_numbers({0, 1, 20}),
                one_of({"noMaterialResponse", "materialGlowTintsLight", "independent"})));
        if (type == "Cube")
            add(fmt::format(" double size = {}\n", between(0.3, 1.5)));
        else if (type == "Sphere")
            add(fmt::format(" double radius = {}\n", between(0.2, 1)));
        else if (type == "Plane")
            add(fmt::format(
                " double width = {}\n double length = {}\n uniform token axis = \"{}\"\n",
                between(0.5, 2), between(0.5, 2), one_of({"X", "Y", "Z"})));
        else if (type == "Mesh")
            add_mesh();
        else if (type == "BasisCurves")
            add_curves();
        else if (type == "Points")
            add_points();
        else
            add(fmt::format(
                " double radius = {}\n double height = {}\n uniform token axis = \"{}\"\n",
                between(0.2, 0.8), between(0.2, 1.5), one_of({"X", "Y", "Z"})));
        add_binding();
        add_placement(place == Place::World ? spot() : "(0, 0, 0)", 1.6);
        add("}\n");
    }

    /// A sheet of 2 x 2 quads, a closed tetrahedron, or triangles anywhere.
    void add_mesh() {
        std::string points, later;
        const auto add_point = [&](double x, double y, double z) {
            points += fmt::format("{}({}, {}, {})", points.empty() ? "" : ", ", x, y, z);
            later += fmt::format("{}({}, {}, {})", later.empty() ? "" : ", ",
                                 x + between(-0.2, 0.2), y + between(-0.2, 0.2), z);
        };
        const int kind = below(3);
        std::string counts, indices;
        if (kind == 0) {
            const double wave = between(0, 0.4);
            for (int i = 0; i < 9; ++i) add_point(i % 3 - 1, i / 3 - 1, i % 2 ? wave : 0);
            counts = "4, 4, 4, 4";
            indices = "0, 1, 4, 3, 1, 2, 5, 4, 3, 4, 7, 6, 4, 5, 8, 7";
        } else if (kind == 1) {
            const double s = between(0.3, 0.9);
            add_point(s, s, s), add_point(-s, -s, s), add_point(-s, s, -s), add_point(s, -s, -s);
            counts = "3, 3, 3, 3";
            indices = "0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3";
        } else {
            for (int i = 0; i < 12; ++i) {
                add_point(between(-1, 1), between(-1, 1), between(-1, 1));
                indices += fmt::format("{}{}", i ? ", " : "", i);
            }
            counts = "3, 3, 3, 3";
        }
        add(
            fmt::format(" int[] faceVertexCounts = [{}]\n int[] faceVertexIndices = [{}]\n uniform "
                        "token subdivisionScheme = \"none\"\n",
                        counts, indices));
        if (chance(0.2))
            add(fmt::format(" point3f[] points.timeSamples = {{ 0: [{}], 1: [{}] }}\n", points,
                            later));
        else
            add(fmt::format(" point3f[] points = [{}]\n", points));
        if (kind == 0 && chance(0.5)) {
            std::string normals;
            for (int i = 0; i < 9; ++i)
                normals += fmt::format("{}({}, {}, 1)", i ? ", " : "", between(-0.6, 0.6),
                                       between(-0.6, 0.6));
            add(fmt::format(" normal3f[] normals = [{}] (interpolation = \"vertex\")\n", normals));
        }
    }

    void add_curves() {
        const int curves = 1 + below(3);
        std::string counts, points, normals;
        for (int i = 0; i < curves; ++i) {
            counts += i ? ", 4" : "4";
            const double x = between(-1, 1);
            for (int k = 0; k < 4; ++k) {
                points += fmt::format("{}({}, {}, {})", points.empty() ? "" : ", ",
                                      x + between(-0.3, 0.3), 0.6 * k, between(-0.3, 0.3));
                normals +=
                    fmt::format("{}(0, {}, 1)", normals.empty() ? "" : ", ", between(-0.3, 0.3));
            }
        }
        add(
            fmt::format(" int[] curveVertexCounts = [{}]\n point3f[] points = [{}]\n float[] "
                        "widths = [{}] (interpolation = \"constant\")\n",
                        counts, points, one_of_numbers({0.01, 0.1, 0.5})));
        if (chance(0.3))
            add(" uniform token type = \"linear\"\n");
        else
            add(fmt::format(" uniform token type = \"cubic\"\n uniform token basis = \"{}\"\n",
                            one_of({"bezier", "bspline", "catmullRom"})));
        if (chance(0.3))
            add(fmt::format(" normal3f[] normals = [{}]{}\n", normals,
                            " (interpolation = \"vertex\")"));
    }

    void add_points() {
        std::string points, widths;
        const int count = 1 + below(6);
        for (int i = 0; i < count; ++i) {
            points += (i ? ", " : "") + vector(-1, 1);
            widths += fmt::format("{}{}", i ? ", " : "", between(0.02, 0.6));
        }
        add(fmt::format(" point3f[] points = [{}]\n float[] widths = [{}]\n", points, widths));
    }

    void add_native_instances() {
        add("class Xform \"Proto\" {\n");
        const int shapes = 1 + below(2);
        for (int i = 0; i < shapes; ++i) add_shape(fmt::format("Part{}", i), Place::Prototype);
        add("}\n");
        const int copies = 1 + below(4);
        for (int i = 0; i < copies; ++i) {
            add(fmt::format(
                "def Xform \"Copy{}\" (instanceable = true\n prepend references = </Proto>) {{\n",
                i));
            add_placement(spot(), 1.5);
            add("}\n");
        }
    }

    void add_point_instancer() {
        add("def PointInstancer \"Scatter\" {\n rel prototypes = [</Scatter/A>]\n");
        std::string indices, positions, orientations;
        const int count = 1 + below(5);
        for (int i = 0; i < count; ++i) {
            indices += i ? ", 0" : "0";
            positions += (i ? ", " : "") + spot();
            const double half = between(0, 3.1);
            orientations +=
                fmt::format("{}({}, 0, {}, 0)", i ? ", " : "", std::cos(half), std::sin(half));
        }
        add(fmt::format(" int[] protoIndices = [{}]\n point3f[] positions = [{}]\n", indices,
                        positions));
        if (chance(0.5)) add(fmt::format(" quath[] orientations = [{}]\n", orientations));
        add_shape("A", Place::Prototype);
        add("}\n");
    }

    void add_volume() {
        add(
            fmt::format("def Volume \"Smoke\" {{\n rel field:{} = </Smoke/F>\n def OpenVDBAsset "
                        "\"F\" {{\n token fieldName = \"{}\"\n }}\n",
                        one_of({"density", "heat"}), one_of({"waves", "zeros"})));
        add_placement(spot(), 1.5);
        add("}\n");
    }

    void add_light(const std::string& name) {
        const std::string_view type = one_of({"RectLight", "SphereLight", "DiskLight",
                                              "CylinderLight", "DistantLight", "DomeLight"});
        add(fmt::format("def {} \"{}\" (prepend apiSchemas = [\"ShapingAPI\", \"ShadowAPI\"]) {{\n",
                        type, name));
        add(fmt::format(" float inputs:intensity = {}\n color3f inputs:color = {}\n",
                        one_of_numbers({0, 1e-3, 1, 8, 1e4}), color()));
        if (type == "RectLight")
            add(fmt::format(" float inputs:width = {}\n float inputs:height = {}\n",
                            between(0.1, 3), between(0.1, 3)));
        if (type == "SphereLight" || type == "DiskLight" || type == "CylinderLight")
            add(fmt::format(" float inputs:radius = {}\n", one_of_numbers({0.001, 0.2, 1})));
        if (type == "DistantLight")
            add(fmt::format(" float inputs:angle = {}\n", one_of_numbers({0, 0.53, 20})));
        add_input("bool", "normalize", "1", 0.3);
        const bool has_size = type != "DistantLight" && type != "DomeLight";
        if (has_size && chance(0.25))
            add(fmt::format(
                " float inputs:shaping:cone:angle = {}\n float inputs:shaping:cone:softness = {}\n",
                one_of_numbers({10, 60, 180}), share()));
        if (has_size && chance(0.15))
            add(fmt::format(" float inputs:shaping:focus = {}\n", between(0, 5)));
        if (has_size && chance(0.15))
            add(" asset inputs:shaping:ies:file = @velatura_identity_lamp.ies@\n");
        add_input("float", "diffuse", fmt::format("{}", one_of_numbers({0, 0.5, 1})), 0.2);
        add_input("float", "specular", fmt::format("{}", one_of_numbers({0, 0.5, 1})), 0.2);
        if (chance(0.15)) add(" rel collection:lightLink:excludes = </Shape0>\n");
        if (chance(0.15)) add(" rel collection:shadowLink:excludes = </Shape0>\n");
        if (chance(0.1)) add(fmt::format(" float inputs:shadow:distance = {}\n", between(0.3, 4)));
        if (chance(0.1)) add(fmt::format(" color3f inputs:shadow:color = {}\n", color()));
        if (chance(0.05)) add(" bool inputs:shadow:enable = 0\n");
        if (type != "DomeLight")
            add_placement(
                fmt::format("({}, {}, {})", between(-2, 2), between(1, 4), between(-1, 4)), 2.0);
        add("}\n");
    }

    std::mt19937_64 random_;
    std::string text_;
    int materials_ = 0;
};

}  // namespace

std::string random_scene_usda(uint64_t seed) {
    return StageWriter(seed).write();
}

}  // namespace velatura::test
