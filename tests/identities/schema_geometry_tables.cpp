// SPDX-License-Identifier: Apache-2.0
// Attributes of geometry and what twins they have.
#include "schema_attributes.h"

namespace velatura::test {

namespace {

using Rows = std::vector<AttributeRow>;

const std::string none = "uniform token subdivisionScheme = \"none\"\n";
const std::string one_face =
    "int[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 3]\n";
const std::string two_faces =
    "int[] faceVertexCounts = [4, 4]\nint[] faceVertexIndices = [0, 1, 2, 3, 4, 5, 6, 7]\n";
const std::string square = "[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]";
const std::string moved_square = "[(0, -1, 0), (2, -1, 0), (2, 1, 0), (0, 1, 0)]";
const std::string pair =
    "point3f[] points = [(-1.5, -1, 0), (-0.5, -1, 0), (-0.5, 1, 0), (-1.5, 1, 0), (0.5, -1, 0), "
    "(1.5, -1, 0), (1.5, 1, 0), (0.5, 1, 0)]\n";
const std::string left_half =
    "point3f[] points = [(-1.5, -1, 0), (-0.5, -1, 0), (-0.5, 1, 0), (-1.5, 1, 0)]\n";
const std::string right_half =
    "point3f[] points = [(0.5, -1, 0), (1.5, -1, 0), (1.5, 1, 0), (0.5, 1, 0)]\n";
const std::string red = R"usda(
def Material "Red" {
    token outputs:surface.connect = </Red/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.8, 0.1, 0.1)
        token outputs:surface
    }
}
)usda";

std::string mesh(const std::string& body, const std::string& name = "M") {
    return "def Mesh \"" + name + "\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) {\n" + none +
           body + "\n}\n";
}

std::string prim(const std::string& type, const std::string& body) {
    return "def " + type + " \"P\" {\n" + body + "\n}\n";
}

std::string curves(const std::string& body) {
    return prim("BasisCurves", body);
}

const scene::Mesh& mesh_of(const scene::Scene& s) {
    return std::get<scene::Mesh>(s.shapes.at(0).geometry);
}

/// A mesh whose rules of subdivision are compared: their limit surfaces are tested in
/// tests/subdivision.
AttributeRow rule(const std::string& attribute,
                  const std::string& authored,
                  double value,
                  double (*read)(const scene::Mesh&),
                  const std::string& beside = "") {
    AttributeRow row{"Mesh", attribute, "def Mesh \"M\" {\n" + two_faces + pair + beside + "$\n}\n",
                     authored};
    row.read = [read](const scene::Scene& s) { return read(mesh_of(s)); };
    row.value = value;
    row.is_rendered = false;
    return row;
}

void add_meshes(Rows& rows) {
    const std::string points = "point3f[] points = " + square + "\n";
    const std::string plane = prim("Plane", "");
    rows.push_back({"PointBased", "points", mesh(one_face + "$"), points, plane});
    rows.push_back({"Mesh", "faceVertexCounts",
                    mesh("int[] faceVertexIndices = [0, 1, 2, 3]\n" + points + "$"),
                    "int[] faceVertexCounts = [4]", plane});
    rows.push_back({"Mesh", "faceVertexIndices",
                    mesh("int[] faceVertexCounts = [4]\n" + points + "$"),
                    "int[] faceVertexIndices = [0, 1, 2, 3]", plane});
    rows.push_back({"Mesh", "holeIndices", mesh(two_faces + pair + "$"), "int[] holeIndices = [1]",
                    mesh(one_face + left_half)});
    // A facing surface of albedo 0.5 in light of irradiance π shows 0.5 cosθ; the tilt has 0.8
    const std::string sun =
        "def DistantLight \"Sun\" { float inputs:angle = 0\nfloat inputs:intensity = 3.14159265 }\n"
        "@dark\n";
    AttributeRow normals{"PointBased", "normals", sun + mesh(one_face + points + "$"),
                         "normal3f[] normals = [(0.6, 0, 0.8), (0.6, 0, 0.8), (0.6, 0, 0.8), (0.6, "
                         "0, 0.8)]"};
    normals.middle = {0.4, 0.4, 0.4};
    rows.push_back(normals);
    // One second before the frame, at 24 time codes per second
    const std::string since = "point3f[] points.timeSamples = { -24: " + square + " }\n";
    rows.push_back({"PointBased", "velocities", mesh(one_face + since + "$"),
                    "vector3f[] velocities.timeSamples = { -24: [(1, 0, 0), (1, 0, 0), (1, 0, 0), "
                    "(1, 0, 0)] }",
                    mesh(one_face + "point3f[] points = " + moved_square)});
    // ½ a t²
    rows.push_back({"PointBased", "accelerations",
                    mesh(one_face + since +
                         "vector3f[] velocities.timeSamples = { -24: [(0, 0, 0), (0, 0, 0), (0, 0, "
                         "0), (0, 0, 0)] }\n$"),
                    "vector3f[] accelerations.timeSamples = { -24: [(2, 0, 0), (2, 0, 0), (2, 0, "
                    "0), (2, 0, 0)] }",
                    mesh(one_face + "point3f[] points = " + moved_square)});
    const auto subset = [](const std::string& body) {
        return mesh(two_faces + pair +
                    "def GeomSubset \"S\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) {\nrel "
                    "material:binding = </Red>\n" +
                    body + "\n}") +
               red;
    };
    const std::string family = "uniform token familyName = \"materialBind\"\n";
    const std::string halves =
        mesh(one_face + left_half) +
        mesh(one_face + right_half + "rel material:binding = </Red>\n", "N") + red;
    rows.push_back({"GeomSubset", "indices", subset(family + "$"), "int[] indices = [1]", halves});
    rows.push_back({"GeomSubset", "familyName", subset("int[] indices = [1]\n$"), family, halves});
    rows.push_back({"GeomSubset", "elementType", subset(family + "int[] indices = [1]\n$"),
                    "uniform token elementType = \"point\"", mesh(two_faces + pair) + red});
    for (AttributeRow& row : rows) row.tolerance = row.middle.empty() ? row.tolerance : 1e-2;
}

void add_subdivision(Rows& rows) {
    rows.push_back(rule("subdivisionScheme", "uniform token subdivisionScheme = \"loop\"",
                        double(scene::SubdivisionScheme::Loop),
                        [](const scene::Mesh& m) { return double(m.subdivision); }));
    rows.push_back(rule("interpolateBoundary", "token interpolateBoundary = \"edgeOnly\"",
                        double(scene::BoundaryInterpolation::EdgeOnly),
                        [](const scene::Mesh& m) { return double(m.rules.boundary); }));
    rows.push_back(rule("faceVaryingLinearInterpolation",
                        "token faceVaryingLinearInterpolation = \"all\"",
                        double(scene::FaceVaryingInterpolation::All),
                        [](const scene::Mesh& m) { return double(m.rules.face_varying); }));
    rows.push_back(rule("triangleSubdivisionRule", "token triangleSubdivisionRule = \"smooth\"",
                        double(scene::TriangleRule::Smooth),
                        [](const scene::Mesh& m) { return double(m.rules.triangles); }));
    const auto corners = [](const scene::Mesh& m) {
        return m.rules.corner_sharpnesses.empty() ? 0.0 : double(m.rules.corner_sharpnesses[0]);
    };
    rows.push_back(rule("cornerIndices", "int[] cornerIndices = [2]", 3, corners,
                        "float[] cornerSharpnesses = [3]\n"));
    rows.push_back(rule("cornerSharpnesses", "float[] cornerSharpnesses = [3]", 3, corners,
                        "int[] cornerIndices = [2]\n"));
    const auto creases = [](const scene::Mesh& m) {
        return m.rules.crease_sharpnesses.empty() ? 0.0 : double(m.rules.crease_sharpnesses[0]);
    };
    const std::string indices = "int[] creaseIndices = [0, 1]\n",
                      lengths = "int[] creaseLengths = [2]\n",
                      sharp = "float[] creaseSharpnesses = [4]\n";
    rows.push_back(rule("creaseIndices", indices, 4, creases, lengths + sharp));
    rows.push_back(rule("creaseLengths", lengths, 4, creases, indices + sharp));
    rows.push_back(rule("creaseSharpnesses", sharp, 4, creases, indices + lengths));
}

void add_gprims(Rows& rows) {
    const auto scaled = [](const std::string& type, const std::string& scale,
                           const std::string& more = "") {
        return prim(type, more + op("scale", scale));
    };
    const std::string x = "uniform token axis = \"X\"\n";
    rows.push_back({"Sphere", "radius", prim("Sphere", "$"), "double radius = 0.5",
                    scaled("Sphere", "(0.5, 0.5, 0.5)")});
    rows.push_back(
        {"Cube", "size", prim("Cube", "$"), "double size = 1", scaled("Cube", "(0.5, 0.5, 0.5)")});
    for (const char* type : {"Cylinder", "Cone"}) {
        rows.push_back({type, "height", prim(type, x + "$"), "double height = 1",
                        scaled(type, "(0.5, 1, 1)", x)});
        rows.push_back({type, "radius", prim(type, x + "$"), "double radius = 0.5",
                        scaled(type, "(1, 0.5, 0.5)", x)});
    }
    rows.push_back({"Cylinder_1", "height", prim("Cylinder_1", x + "$"), "double height = 1",
                    scaled("Cylinder", "(0.5, 1, 1)", x)});
    rows.push_back({"Cylinder_1", "radiusBottom",
                    prim("Cylinder_1", x + "double radiusTop = 0.5\n$"),
                    "double radiusBottom = 0.5", scaled("Cylinder", "(1, 0.5, 0.5)", x)});
    // A capsule is a straight round curve with its round ends
    const auto rod = [](const std::string& half, const std::string& width) {
        return curves(
            "uniform token type = \"linear\"\nint[] curveVertexCounts = [2]\npoint3f[] "
            "points = [(-" +
            half + ", 0, 0), (" + half + ", 0, 0)]\nfloat[] widths = [" + width +
            "] (interpolation = \"constant\")");
    };
    for (const std::string type : {"Capsule", "Capsule_1"}) {
        const bool is_new = type == "Capsule_1";
        rows.push_back({type, "height", prim(type, x + "$"), "double height = 2", rod("1", "1")});
        rows.push_back({type, is_new ? "radiusBottom" : "radius",
                        prim(type, x + (is_new ? "double radiusTop = 0.25\n$" : "$")),
                        is_new ? "double radiusBottom = 0.25" : "double radius = 0.25",
                        rod("0.5", "0.5")});
    }
    for (const char* type : {"Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1"})
        rows.push_back({type, "axis", prim(type, "$"), x, prim(type, op("rotateY", "90"))});
    rows.push_back(
        {"Plane", "width", prim("Plane", "$"), "double width = 1", scaled("Plane", "(0.5, 1, 1)")});
    rows.push_back({"Plane", "length", prim("Plane", "$"), "double length = 1",
                    scaled("Plane", "(1, 0.5, 1)")});
    rows.push_back({"Plane", "axis", prim("Plane", op("rotateY", "30") + "$"), x,
                    prim("Plane", op("rotateY", "120"))});
    for (const char* schema : {"Gprim", "Plane"}) {
        AttributeRow sides{schema, "doubleSided", prim("Plane", "$"),
                           "uniform bool doubleSided = 0"};
        if (schema == std::string("Gprim"))
            sides = {schema, "doubleSided", prim("Sphere", "$"), "uniform bool doubleSided = 1"};
        sides.read = [](const scene::Scene& s) { return s.shapes.at(0).double_sided ? 1.0 : 0.0; };
        sides.value = schema == std::string("Gprim") ? 1 : 0;
        sides.is_rendered = false;
        rows.push_back(sides);
    }
    AttributeRow orientation{"Gprim", "orientation", prim("Sphere", "$"),
                             "uniform token orientation = \"leftHanded\""};
    orientation.read = [](const scene::Scene& s) {
        return s.shapes.at(0).flip_normals ? 1.0 : 0.0;
    };
    orientation.value = 1;
    orientation.is_rendered = false;
    rows.push_back(orientation);
    // A Lambert surface in a white dome shows its albedo
    AttributeRow color{"Gprim", "primvars:displayColor", prim("Sphere", "$"),
                       "color3f[] primvars:displayColor = [(0.8, 0.4, 0.1)]"};
    color.middle = {0.8, 0.4, 0.1};
    rows.push_back(color);
    // 0.25 of albedo 0.5, and 0.75 of the dome behind
    AttributeRow opacity{"Gprim", "primvars:displayOpacity", prim("Plane", "$"),
                         "float[] primvars:displayOpacity = [0.25]"};
    opacity.middle = {0.875, 0.875, 0.875};
    opacity.tolerance = 2e-2;
    rows.push_back(opacity);
}

void add_strands(Rows& rows) {
    const std::string linear = "uniform token type = \"linear\"\n",
                      thin = "float[] widths = [0.5] (interpolation = \"constant\")\n";
    const std::string rod = prim("Capsule",
                                 "uniform token axis = \"X\"\ndouble radius = 0.25\n"
                                 "double height = 2");
    const std::string ends = "point3f[] points = [(-1, 0, 0), (1, 0, 0)]\n";
    rows.push_back({"Curves", "curveVertexCounts", curves(linear + ends + thin + "$"),
                    "int[] curveVertexCounts = [2]", rod});
    rows.push_back({"Curves", "widths", curves(linear + ends + "int[] curveVertexCounts = [2]\n$"),
                    "float[] widths = [0.5, 0.5]", rod});
    rows.push_back(
        {"BasisCurves", "type",
         curves(thin + "int[] curveVertexCounts = [4]\npoint3f[] points = [(-1.2, -1, 0), "
                       "(-0.4, 1, 0), (0.4, -1, 0), (1.2, 1, 0)]\n$"),
         linear,
         curves(linear + thin +
                "int[] curveVertexCounts = [2, 2, 2]\npoint3f[] points = [(-1.2, -1, 0), "
                "(-0.4, 1, 0), (-0.4, 1, 0), (0.4, -1, 0), (0.4, -1, 0), (1.2, 1, 0)]")});
    // A B-spline is the Bézier curve of (p0 + 4 p1 + p2)/6, (2 p1 + p2)/3, (p1 + 2 p2)/3,
    // (p1 + 4 p2 + p3)/6
    rows.push_back(
        {"BasisCurves", "basis",
         curves(thin + "int[] curveVertexCounts = [4]\npoint3f[] points = [(-3, 0, 0), "
                       "(-1.5, 1.5, 0), (1.5, -1.5, 0), (3, 0, 0)]\n$"),
         "uniform token basis = \"bspline\"",
         curves(thin + "int[] curveVertexCounts = [4]\npoint3f[] points = [(-1.25, 0.75, "
                       "0), (-0.5, 0.5, 0), (0.5, -0.5, 0), (1.25, -0.75, 0)]")});
    rows.push_back({"BasisCurves", "wrap",
                    curves(linear + thin +
                           "int[] curveVertexCounts = [3]\npoint3f[] points = [(-1, "
                           "-1, 0), (1, -1, 0), (0, 1, 0)]\n$"),
                    "uniform token wrap = \"periodic\"",
                    curves(linear + thin +
                           "int[] curveVertexCounts = [4]\npoint3f[] points = [(-1, "
                           "-1, 0), (1, -1, 0), (0, 1, 0), (-1, -1, 0)]")});
    const std::string dot = "point3f[] points = [(0, 0, 0)]\n";
    rows.push_back({"Points", "widths", prim("Points", dot + "$"), "float[] widths = [2]",
                    prim("Sphere", "")});
    // Other points while the shutter is open are no motion of these
    const std::string open = "@close 1\n";
    rows.push_back({"Points", "ids",
                    open + prim("Points",
                                "float[] widths = [1]\npoint3f[] points.timeSamples = { 0: "
                                "[(-1, 0, 0)], 1: [(1, 0, 0)] }\n$"),
                    "int64[] ids.timeSamples = { 0: [1], 1: [2] }",
                    prim("Sphere", "double radius = 0.5\n" + at("(-1, 0, 0)"))});
}

void add_instancer(Rows& rows) {
    const auto instancer = [](const std::string& body) {
        return "def PointInstancer \"I\" {\nrel prototypes = [</I/Ball>, </I/Box>]\n" + body +
               "\ndef Sphere \"Ball\" { double radius = 0.4 }\ndef Cube \"Box\" { double size = "
               "0.8 "
               "}\n}\n";
    };
    const auto ball = [](const std::string& place, const std::string& radius = "0.4") {
        return "def Sphere \"A\" { double radius = " + radius + "\n" + at(place) + "}\n";
    };
    const auto box = [](const std::string& place, const std::string& turn = "0",
                        const std::string& size = "0.8") {
        return "def Cube \"B\" { double size = " + size + "\ndouble3 xformOp:translate = " + place +
               "\ndouble xformOp:rotateZ = " + turn +
               "\nuniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:rotateZ\"] }\n";
    };
    const std::string both = "int[] protoIndices = [0, 1]\n",
                      places = "point3f[] positions = [(-1, 0, 0), (1, 0, 0)]\n";
    const std::string placed = ball("(-1, 0, 0)") + box("(1, 0, 0)");
    rows.push_back({"PointInstancer", "protoIndices", instancer(places + "$"), both, placed});
    rows.push_back({"PointInstancer", "positions", instancer(both + "$"), places, placed});
    rows.push_back({"PointInstancer", "scales", instancer(both + places + "$"),
                    "float3[] scales = [(0.5, 0.5, 0.5), (0.5, 0.5, 0.5)]",
                    ball("(-1, 0, 0)", "0.2") + box("(1, 0, 0)", "0", "0.4")});
    const std::string turned = ball("(-1, 0, 0)") + box("(1, 0, 0)", "45");
    rows.push_back({"PointInstancer", "orientations", instancer(both + places + "$"),
                    "quath[] orientations = [(1, 0, 0, 0), (0.92388, 0, 0, 0.382683)]", turned});
    rows.push_back({"PointInstancer", "orientationsf", instancer(both + places + "$"),
                    "quatf[] orientationsf = [(1, 0, 0, 0), (0.92388, 0, 0, 0.382683)]", turned});
    rows.push_back({"PointInstancer", "invisibleIds", instancer(both + places + "$"),
                    "int64[] invisibleIds = [1]", ball("(-1, 0, 0)")});
    rows.push_back({"PointInstancer", "ids",
                    instancer(both + places + "int64[] invisibleIds = [7]\n$"),
                    "int64[] ids = [6, 7]", ball("(-1, 0, 0)")});
    const std::string since =
        "point3f[] positions.timeSamples = { -24: [(-1, 0, 0), (1, 0, 0)] }\n";
    const std::string raised = ball("(-1, 0.5, 0)") + box("(1, 0.5, 0)");
    rows.push_back({"PointInstancer", "velocities", instancer(both + since + "$"),
                    "vector3f[] velocities.timeSamples = { -24: [(0, 0.5, 0), (0, 0.5, 0)] }",
                    raised});
    rows.push_back({"PointInstancer", "accelerations",
                    instancer(both + since +
                              "vector3f[] velocities.timeSamples = { -24: [(0, 0, 0), "
                              "(0, 0, 0)] }\n$"),
                    "vector3f[] accelerations.timeSamples = { -24: [(0, 1, 0), (0, 1, 0)] }",
                    raised});
    rows.push_back({"PointInstancer", "angularVelocities",
                    instancer(both + places +
                              "quatf[] orientationsf.timeSamples = { -24: [(1, 0, 0, "
                              "0), (1, 0, 0, 0)] }\n$"),
                    "vector3f[] angularVelocities.timeSamples = { -24: [(0, 0, 45), (0, 0, 45)] }",
                    turned});
}

}  // namespace

std::vector<AttributeRow> geometry_rows() {
    Rows rows;
    add_meshes(rows);
    add_subdivision(rows);
    add_gprims(rows);
    add_strands(rows);
    add_instancer(rows);
    rows.push_back({"Imageable", "visibility", prim("Sphere", "$"),
                    "token visibility = \"invisible\"", "def Xform \"P\" {}\n"});
    rows.push_back({"Imageable", "purpose", prim("Sphere", "$"),
                    "uniform token purpose = \"guide\"", "def Xform \"P\" {}\n"});
    rows.push_back({"Xformable", "xformOpOrder",
                    prim("Sphere", "double3 xformOp:translate = (1, 0, 0)\n$"),
                    "uniform token[] xformOpOrder = [\"xformOp:translate\"]",
                    prim("Sphere", op("transform",
                                      "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 0, "
                                      "0, 1))"))});
    // A field of half speed, or the shutter open half as long
    const auto moving = [](const std::string& close, const std::string& body) {
        return "@close " + close +
               "\ndef Plane \"P\" (prepend apiSchemas = [\"MotionAPI\"]) {\ndouble3 "
               "xformOp:translate.timeSamples = { 0: (-1, 0, 0), 1: (1, 0, 0) }\nuniform token[] "
               "xformOpOrder = [\"xformOp:translate\"]\n" +
               body + "\n}\n";
    };
    rows.push_back({"MotionAPI", "motion:blurScale", moving("1", "$"),
                    "float motion:blurScale = 0.5", moving("0.5", "")});
    rows.back().tolerance = 1e-2;
    const auto carried = [](const std::string& speed, const std::string& body) {
        return "def Mesh \"M\" (prepend apiSchemas = [\"MotionAPI\"]) {\n" + none + one_face +
               "point3f[] points.timeSamples = { -24: " + square +
               " }\nvector3f[] velocities.timeSamples = { -24: [(" + speed + ", 0, 0), (" + speed +
               ", 0, 0), (" + speed + ", 0, 0), (" + speed + ", 0, 0)] }\n" + body + "\n}\n";
    };
    rows.push_back({"MotionAPI", "motion:velocityScale", carried("0.5", "$"),
                    "float motion:velocityScale = 2", carried("1", "")});
    return rows;
}

}  // namespace velatura::test
