// SPDX-License-Identifier: Apache-2.0
#include "bench_shapes.h"

#include <cmath>

namespace velatura::bench {

namespace {

float relief(const Vec3& p, const BlobShape& shape) {
    float height = 0, frequency = 3, amplitude = 0.08f;
    for (int octave = 0; octave < shape.octaves; ++octave) {
        const float phase = shape.phase + 0.7f * float(octave);
        height += amplitude *
                  std::sin(frequency * p.x + shape.phase + 1.3f * std::sin(frequency * p.y)) *
                  std::sin(frequency * p.z + phase);
        frequency *= 2.3f;
        amplitude *= 0.5f;
    }
    return height;
}

}  // namespace

uint64_t Random::bits() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

void BenchMesh::add(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = uint32_t(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
}

void BenchMesh::add_quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto first = uint32_t(positions.size());
    positions.insert(positions.end(), {a, b, c, d});
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
}

void BenchMesh::add_box(const Vec3& o, const Vec3& x, const Vec3& y, const Vec3& z) {
    add_quad(o, o + x, o + x + y, o + y);
    add_quad(o + z, o + z + x, o + z + x + y, o + z + y);
    add_quad(o, o + x, o + x + z, o + z);
    add_quad(o + y, o + y + x, o + y + x + z, o + y + z);
    add_quad(o, o + y, o + y + z, o + z);
    add_quad(o + x, o + x + y, o + x + y + z, o + x + z);
}

void BenchMesh::add_column(const Vec3& foot, const Vec3& axis, float radius, int sides) {
    const Frame frame = Frame::from_z(normalize(axis));
    const auto ring = [&](int j) {
        const float phi = 2 * pi * float(j) / float(sides);
        return (frame.x * std::cos(phi) + frame.y * std::sin(phi)) * radius;
    };
    for (int j = 0; j < sides; ++j) {
        add_quad(foot + ring(j), foot + ring(j + 1), foot + axis + ring(j + 1),
                 foot + axis + ring(j));
    }
}

void BenchMesh::add(const BenchMesh& other, const Mat4& m) {
    const auto first = uint32_t(positions.size());
    for (const Vec3& p : other.positions) positions.push_back(transform_point(p, m));
    for (const auto& v : other.triangles) {
        triangles.push_back({first + v[0], first + v[1], first + v[2]});
    }
}

void add_blob(BenchMesh& mesh, const BlobShape& shape, int rings) {
    const auto first = uint32_t(mesh.positions.size());
    const int sectors = 2 * rings;
    for (int i = 0; i <= rings; ++i) {
        for (int j = 0; j < sectors; ++j) {
            const float theta = pi * float(i) / float(rings);
            const float phi = 2 * pi * float(j) / float(sectors);
            const Vec3 n(std::sin(theta) * std::cos(phi), std::cos(theta),
                         std::sin(theta) * std::sin(phi));
            const Vec3 p = n * (1.0f + relief(n, shape));
            const float turn = 0.5f * shape.twist * p.y, c = std::cos(turn), s = std::sin(turn);
            mesh.positions.push_back(
                shape.center + Vec3(p.x * c - p.z * s, p.y, p.x * s + p.z * c) * shape.radius);
        }
    }
    const auto at = [&](int i, int j) { return first + uint32_t(i * sectors + j % sectors); };
    for (int i = 0; i < rings; ++i) {
        for (int j = 0; j < sectors; ++j) {
            if (i > 0) mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
            if (i + 1 < rings)
                mesh.triangles.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
        }
    }
}

}  // namespace velatura::bench
