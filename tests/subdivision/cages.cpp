// SPDX-License-Identifier: Apache-2.0
#include "cages.h"

#include "plugin/registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>

namespace velatura::subdivision::test {

const geometry::Subdivider* open_subdivider() {
    Diagnostics diagnostics;
    const plugin::Registry registry({{VELATURA_BUILT_PLUGINS}}, diagnostics);
    const plugin::Manifest* manifest =
        registry.find(geometry::subdivider_interface, {"effect", "subdivision"});
    if (manifest == nullptr) return nullptr;
    return static_cast<const geometry::Subdivider*>(
        plugin::open_interface(*manifest, geometry::subdivider_interface,
                               geometry::subdivider_interface_version, diagnostics));
}

scene::Mesh make_cage(scene::SubdivisionScheme scheme,
                      std::vector<Vec3> points,
                      const std::vector<std::vector<uint32_t>>& faces) {
    scene::Mesh mesh;
    mesh.subdivision = scheme;
    mesh.points = std::move(points);
    for (const auto& face : faces) {
        mesh.face_vertex_counts.push_back(uint32_t(face.size()));
        mesh.face_vertex_indices.insert(mesh.face_vertex_indices.end(), face.begin(), face.end());
    }
    return mesh;
}

scene::Mesh cube() {
    std::vector<Vec3> points;
    for (int i = 0; i < 8; ++i)
        points.emplace_back(i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f);
    return make_cage(
        scene::SubdivisionScheme::CatmullClark, points,
        {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}});
}

scene::Mesh grid(uint32_t columns, uint32_t rows) {
    std::vector<Vec3> points;
    std::vector<std::vector<uint32_t>> faces;
    for (uint32_t y = 0; y <= rows; ++y)
        for (uint32_t x = 0; x <= columns; ++x)
            points.emplace_back(float(x), float(y), 0.3f * float((x * 7 + y * 5) % 4));
    const uint32_t w = columns + 1;
    for (uint32_t y = 0; y < rows; ++y)
        for (uint32_t x = 0; x < columns; ++x)
            faces.push_back({y * w + x, y * w + x + 1, y * w + x + 1 + w, y * w + x + w});
    return make_cage(scene::SubdivisionScheme::CatmullClark, points, faces);
}

namespace {

scene::Mesh octahedron(scene::SubdivisionScheme scheme) {
    return make_cage(
        scheme, {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
        {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}});
}

/// A prism over five corners: pentagons, quads, valence 3.
scene::Mesh prism() {
    std::vector<Vec3> points;
    for (int z = -1; z <= 1; z += 2)
        for (int i = 0; i < 5; ++i) {
            const double angle = 2.0 * pi_d * i / 5.0;
            points.emplace_back(float(std::cos(angle)), float(std::sin(angle)), float(z));
        }
    std::vector<std::vector<uint32_t>> faces = {{4, 3, 2, 1, 0}, {5, 6, 7, 8, 9}};
    for (uint32_t i = 0; i < 5; ++i) faces.push_back({i, (i + 1) % 5, 5 + (i + 1) % 5, 5 + i});
    return make_cage(scene::SubdivisionScheme::CatmullClark, points, faces);
}

}  // namespace

std::vector<Cage> closed_cages() {
    std::vector<Cage> cages;
    cages.push_back({"cube", cube()});
    cages.push_back({"octahedron", octahedron(scene::SubdivisionScheme::CatmullClark)});
    cages.push_back({"loop octahedron", octahedron(scene::SubdivisionScheme::Loop)});
    cages.push_back({"bilinear cube", cube()});
    cages.back().mesh.subdivision = scene::SubdivisionScheme::Bilinear;
    cages.push_back({"prism", prism()});
    cages.push_back({"creased cube", cube()});
    scene::SubdivisionRules& rules = cages.back().mesh.rules;
    rules.creases = {{0, 1}, {1, 3}, {3, 2}, {2, 0}, {4, 5}, {5, 7}};
    rules.crease_sharpnesses = {10, 10, 10, 10, 2.3f, 0.7f};
    rules.corners = {6};
    rules.corner_sharpnesses = {10};
    cages.push_back({"creased prism", prism()});
    cages.back().mesh.rules.creases = {{0, 1}, {1, 2}, {5, 6}, {0, 5}};
    cages.back().mesh.rules.crease_sharpnesses = {10, 1.5f, 3, 10};
    for (Cage& cage : cages) cage.is_smooth = cage.mesh.rules.creases.empty();
    return cages;
}

std::vector<Cage> all_cages() {
    std::vector<Cage> cages = closed_cages();
    cages.push_back({"grid", grid(3, 3)});
    cages.push_back({"grid, edgeOnly", grid(3, 3)});
    cages.back().mesh.rules.boundary = scene::BoundaryInterpolation::EdgeOnly;
    cages.push_back({"grid with a hole", grid(3, 3)});
    cages.back().mesh.rules.holes = {4};
    using enum scene::SubdivisionScheme;
    // Three faces at one edge, and two that meet in a point: OpenSubdiv keeps both sharp
    cages.push_back({"book", make_cage(CatmullClark,
                                       {{0, 0, 0},
                                        {0, 0, 1},
                                        {1, 0, 1},
                                        {1, 0, 0},
                                        {0, 1, 1},
                                        {0, 1, 0},
                                        {-1, 0.2f, 1},
                                        {-1, 0, 0}},
                                       {{0, 1, 2, 3}, {0, 1, 4, 5}, {0, 1, 6, 7}})});
    cages.push_back({"bow tie", make_cage(CatmullClark,
                                          {{0, 0, 0},
                                           {1, 0, 0},
                                           {1, 1, 0},
                                           {0, 1, 0.3f},
                                           {-1, 0, 0},
                                           {-1, -1, 0},
                                           {0, -1, 0.2f}},
                                          {{0, 1, 2, 3}, {0, 4, 5, 6}})});
    cages.push_back({"two cubes on one edge", cube()});
    scene::Mesh& pair = cages.back().mesh;
    for (const Vec3& p : cube().points) pair.points.push_back(p + Vec3(2, 2, 0));
    pair.face_vertex_counts.resize(12, 4);
    // The edge from (1, 1, -1) to (1, 1, 1) is that of both
    for (size_t i = 0; i < 24; ++i) {
        const uint32_t v = pair.face_vertex_indices[i];
        pair.face_vertex_indices.push_back(v == 0 ? 3 : v == 4 ? 7 : v + 8);
    }
    for (size_t i = cages.size() - 3; i < cages.size(); ++i) cages[i].is_smooth = false;
    return cages;
}

geometry::DicedMesh dice(const scene::Mesh& mesh, uint32_t rate, bool stays) {
    const auto surface = open_subdivider()->make(mesh, stays);
    EXPECT_TRUE(surface) << (surface ? "" : surface.error().message);
    if (!surface) return {};
    const std::vector<uint32_t> rates((*surface)->edge_count(), rate);
    Result<geometry::DicedMesh> diced = (*surface)->dice(rates);
    EXPECT_TRUE(diced) << (diced ? "" : diced.error().message);
    return diced ? *std::move(diced) : geometry::DicedMesh();
}

std::vector<uint32_t> uneven_rates(uint32_t edges, uint32_t max, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<uint32_t> rates(edges);
    for (uint32_t& rate : rates) {
        const uint64_t kind = random() % 3;
        rate = kind == 0 ? 1 : kind == 1 ? max : uint32_t(1 + random() % max);
    }
    return rates;
}

size_t open_edges(const geometry::TriangleMeshData& data) {
    using Key = std::array<float, 3>;
    const auto key = [&](uint32_t v) {
        const Vec3& p = data.positions[v];
        return Key{p.x, p.y, p.z};
    };
    std::map<std::pair<Key, Key>, int> balance;
    for (const auto& t : data.triangles)
        for (size_t k = 0; k < 3; ++k) {
            const Key a = key(t[k]), b = key(t[(k + 1) % 3]);
            balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
        }
    return size_t(std::count_if(balance.begin(), balance.end(),
                                [](const auto& entry) { return entry.second != 0; }));
}

}  // namespace velatura::subdivision::test
