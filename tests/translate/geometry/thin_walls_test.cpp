// SPDX-License-Identifier: Apache-2.0
// Which geometry that transmits is a thin wall: what has boundary edges and says nothing of an
// inside.
#include "translate/geometry/thin_walls.h"

#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <variant>
#include <vector>

namespace velatura::translate::geometry {

namespace {

/// A material of clear glass, with more lines in its shader.
std::string glass(const std::string& lines = "", const char* opacity = "0") {
    return fmt::format(R"(
def Material "M" {{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        float inputs:opacity = {}
        {}
        token outputs:surface
    }}
}}
)",
                       opacity, lines);
}

const std::string bound = "rel material:binding = </M>\n";

const std::string polygons = "uniform token subdivisionScheme = \"none\"\n";

scene::Mesh mesh_of(std::vector<Vec3> points,
                    std::vector<uint32_t> counts,
                    std::vector<uint32_t> indices) {
    scene::Mesh mesh;
    mesh.points = std::move(points);
    mesh.face_vertex_counts = std::move(counts);
    mesh.face_vertex_indices = std::move(indices);
    return mesh;
}

/// A box of six faces that share no point; the last `omitted` of them are not there.
scene::Mesh loose_box(size_t omitted = 0, float shift = 0.0f) {
    scene::Mesh mesh;
    const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                             {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (size_t f = 0; f < 6 - omitted; ++f) {
        mesh.face_vertex_counts.push_back(4);
        for (const int corner : faces[f]) {
            mesh.face_vertex_indices.push_back(uint32_t(mesh.points.size()));
            mesh.points.emplace_back(float(corner & 1) + shift * float(f), float(corner >> 1 & 1),
                                     float(corner >> 2 & 1));
        }
    }
    return mesh;
}

/// A ball of longitudes and latitudes as exporters write it: the seam twice, its points computed
/// from 2π, and a pole for each longitude.
scene::Mesh seamed_ball(int columns, int rows) {
    scene::Mesh mesh;
    for (int r = 0; r <= rows; ++r) {
        for (int c = 0; c <= columns; ++c) {
            const double theta = pi_d * r / rows, phi = 2.0 * pi_d * c / columns;
            mesh.points.emplace_back(std::sin(theta) * std::cos(phi), std::cos(theta),
                                     std::sin(theta) * std::sin(phi));
        }
    }
    const auto at = [&](int r, int c) { return uint32_t(r * (columns + 1) + c); };
    for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c) {
            mesh.face_vertex_counts.push_back(4);
            for (const uint32_t i : {at(r, c), at(r + 1, c), at(r + 1, c + 1), at(r, c + 1)})
                mesh.face_vertex_indices.push_back(i);
        }
    }
    return mesh;
}

std::string open_text(const scene::Mesh& mesh) {
    std::string text;
    for (const bool is_open : open_faces(mesh)) text += is_open ? '1' : '0';
    return text;
}

}  // namespace

TEST(OpenFaces, AreThoseOfPiecesWithBoundaryEdges) {
    const std::vector<Vec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    EXPECT_EQ(open_text(mesh_of(square, {4}, {0, 1, 2, 3})), "1");
    // Points are the same by their places
    EXPECT_EQ(open_text(loose_box()), "000000");
    EXPECT_EQ(open_text(loose_box(1)), "11111");
    EXPECT_EQ(open_text(loose_box(0, 1e-7f)), "000000");
    EXPECT_EQ(open_text(loose_box(0, 1e-3f)), "111111");
    EXPECT_EQ(open_text(seamed_ball(16, 8)), std::string(128, '0'));
    // A sheet of two faces with its back: the same points the other way round
    EXPECT_EQ(open_text(mesh_of(square, {3, 3, 3, 3}, {0, 1, 2, 0, 2, 3, 2, 1, 0, 3, 2, 0})),
              "1111");
    // Winding says nothing: two faces at each edge, some the wrong way round
    EXPECT_EQ(open_text(mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {3, 3, 3, 3},
                                {0, 1, 2, 0, 1, 3, 1, 2, 3, 0, 2, 3})),
              "0000");
}

TEST(OpenFaces, OfAMeshOfSeveralPiecesAreToldApart) {
    scene::Mesh mesh = loose_box();
    for (const Vec3& p : {Vec3(5, 0, 0), Vec3(6, 0, 0), Vec3(6, 1, 0), Vec3(5, 1, 0)}) {
        mesh.face_vertex_indices.push_back(uint32_t(mesh.points.size()));
        mesh.points.push_back(p);
    }
    mesh.face_vertex_counts.push_back(4);
    EXPECT_EQ(open_text(mesh), "0000001");
    // A face that is a hole leaves its edges open
    scene::Mesh holed = loose_box();
    holed.subdivision = scene::SubdivisionScheme::CatmullClark;
    holed.rules.holes = {2};
    EXPECT_EQ(open_text(holed).substr(0, 2), "11");
    // Where faces along boundaries vanish, seams are boundaries
    scene::Mesh bare = loose_box();
    bare.subdivision = scene::SubdivisionScheme::CatmullClark;
    EXPECT_EQ(open_text(bare), "000000");
    bare.rules.boundary = scene::BoundaryInterpolation::None;
    EXPECT_EQ(open_text(bare), "111111");
}

TEST(ThinWalls, AreOpenMeshesThatTransmit) {
    struct Case {
        const char* what;
        std::string material, prim;
        bool is_thin;
    };

    const std::string sheet = quad("Q", bound);
    const std::string smooth = R"(
def Mesh "Q" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]
)" + bound;
    const std::string box = R"(
def Mesh "Q" {
    int[] faceVertexCounts = [3, 3, 3, 3]
    int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]
    point3f[] points = [(0,0,0), (1,0,0), (0,1,0), (0,0,1)]
)" + bound + polygons;
    const std::string strand = R"(
    uniform token type = "linear"
    int[] curveVertexCounts = [2]
    point3f[] points = [(0,0,0), (1,0,0)]
    float[] widths = [0.1]
)" + bound;
    const Case cases[] = {
        {"a sheet", glass(), sheet, true},
        {"of part opacity", glass("", "0.5"), sheet, true},
        {"a subdivided sheet", glass(), smooth + "}\n", true},
        {"a closed mesh", glass(), box + "}\n", false},
        {"a closed mesh that exporters call doubleSided", glass(),
         box + "uniform bool doubleSided = true\n}\n", false},
        {"opaque", glass("", "1"), sheet, false},
        {"cut out", glass("token inputs:opacityMode = \"presence\""), sheet, false},
        {"by a threshold", glass("float inputs:opacityThreshold = 0.5"), sheet, false},
        {"said to be solid", glass("bool inputs:velatura:thinWalled = 0"), sheet, false},
        {"with an inside", glass("float inputs:velatura:transmissionDepth = 1"), sheet, false},
        {"with a priority", glass("int inputs:velatura:dielectricPriority = 1"), sheet, false},
        {"of index 1", glass("float inputs:ior = 1"), sheet, false},
        {"a Plane", glass(), "def Plane \"Q\" {\n" + bound + "}\n", true},
        {"a Cube", glass(), "def Cube \"Q\" {\n" + bound + "}\n", false},
        {"a round strand", glass(), "def BasisCurves \"Q\" {\n" + strand + "}\n", false},
        {"a ribbon", glass(),
         "def BasisCurves \"Q\" {\n" + strand + "normal3f[] normals = [(0,0,1),(0,0,1)]\n}\n",
         true},
        {"an instance", glass(),
         "class Xform \"K\" {\n" + sheet + "}\ndef \"I\" (instanceable = true\n" +
             "inherits = </K>) {}\n",
         true},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.what);
        Translated t;
        translate_text(camera() + c.material + c.prim, t);
        ASSERT_EQ(t.scene.materials.size(), 1u);
        EXPECT_EQ(t.scene.materials[0].thin_walled, c.is_thin);
        EXPECT_EQ(t.scene.materials[0].is_open_sheet, c.is_thin);
        EXPECT_EQ(t.count("thin-wall"), c.is_thin ? 1u : 0u);
    }
}

/// One material on a solid and on sheets: the solid keeps it.
TEST(ThinWalls, LeaveClosedPiecesOfTheSameMaterialSolid) {
    const std::string ball = "def Sphere \"B\" {\n" + bound + "}\n";
    Translated t;
    translate_text(camera() + glass() + ball + quad("Q", bound) + quad("R", bound), t);
    ASSERT_EQ(t.scene.materials.size(), 2u);
    EXPECT_FALSE(t.scene.materials[0].thin_walled);
    EXPECT_TRUE(t.scene.materials[1].thin_walled);
    EXPECT_EQ(t.scene.materials[0].name, t.scene.materials[1].name) << "one in Cryptomattes";
    for (const scene::Shape& shape : t.scene.shapes)
        EXPECT_EQ(shape.material, std::holds_alternative<scene::Mesh>(shape.geometry) ? 1u : 0u);
    EXPECT_EQ(t.messages("thin-wall"),
              "/Q: </Q> and 1 more with </M> have boundary edges: rendered as thin walls, without "
              "refraction; inputs:velatura:thinWalled = 0 makes them solids\n");

    // A tetrahedron and a triangle in one mesh
    Translated pieces;
    translate_text(camera() + glass() + R"(
def Mesh "Q" {
    int[] faceVertexCounts = [3, 3, 3, 3, 3]
    int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 4, 5, 6]
    point3f[] points = [(0,0,0), (1,0,0), (0,1,0), (0,0,1), (3,0,0), (4,0,0), (3,1,0)]
)" + bound + polygons + "}\n",
                   pieces);
    ASSERT_EQ(pieces.scene.materials.size(), 2u);
    EXPECT_EQ(pieces.mesh(0).face_materials, (std::vector<scene::MaterialId>{0, 0, 0, 0, 1}));
}

}  // namespace velatura::translate::geometry
