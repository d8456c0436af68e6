// SPDX-License-Identifier: Apache-2.0
#include "geometry/flat_faces.h"

#include "geometry/dicing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace velatura::geometry {

namespace {

/// A face of fewer triangles is left as it is; a trial cuts each edge into so many pieces.
constexpr uint64_t min_triangles = 1024;
constexpr uint32_t trial_pieces = 4;
/// The triangles of a trial, of those of the mesh, at most.
constexpr double max_trial_share = 1.0 / 16;

/// Of the size of a face: 1/25 of a pixel on one that spans 4096.
constexpr double place_tolerance = 1e-5;
constexpr double area_tolerance = 1e-4;
constexpr double normal_tolerance = 2e-4;
/// Of the range of a primvar over the face.
constexpr double primvar_tolerance = 1e-4;
/// Rounding errors of stored numbers, in units of their last place.
constexpr double rounding = 8.0 * double(std::numeric_limits<float>::epsilon());

/// Coordinates in the plane of a face.
struct Plane {
    Vec3d origin, x, y, normal;

    Vec2d place(const Vec3d& p) const { return {(p - origin).dot(x), (p - origin).dot(y)}; }

    double height(const Vec3d& p) const { return (p - origin).dot(normal); }
};

double cross(const Vec2d& a, const Vec2d& b) {
    return a.x * b.y - a.y * b.x;
}

/// The triangles of a trial that belong to one face, and its outline: the limit of its corners.
class FaceTrial {
  public:
    FaceTrial(const TriangleMeshData& data,
              std::span<const uint32_t> triangles,
              std::vector<Vec3d> outline)
        : data_(data), triangles_(triangles), outline_(std::move(outline)) {
        for (const uint32_t t : triangles)
            vertices_.insert(vertices_.end(), data.triangles[t].begin(), data.triangles[t].end());
        std::sort(vertices_.begin(), vertices_.end());
        vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
    }

    bool is_flat() {
        return has_plane() && lies_in_plane() && fills_outline() && has_one_normal() &&
               std::all_of(data_.primvars.begin(), data_.primvars.end(),
                           [&](const scene::Primvar& primvar) { return is_affine(primvar); });
    }

  private:
    Vec3d position(uint32_t vertex) const { return Vec3d(data_.positions[vertex]); }

    /// Spans the plane by three vertices that are far apart; false for what is no surface.
    bool has_plane() {
        if (vertices_.size() < 3) return false;
        const auto farthest = [&](const auto& measure) {
            return *std::max_element(
                vertices_.begin(), vertices_.end(),
                [&](uint32_t a, uint32_t b) { return measure(a) < measure(b); });
        };
        base_[0] = vertices_.front();
        const Vec3d origin = position(base_[0]);
        base_[1] = farthest([&](uint32_t v) { return (position(v) - origin).length(); });
        const Vec3d x = position(base_[1]) - origin;
        base_[2] = farthest([&](uint32_t v) { return (position(v) - origin).cross(x).length(); });
        const Vec3d normal = x.cross(position(base_[2]) - origin);
        size_ = x.length();
        double largest = 0;
        for (const uint32_t v : vertices_) largest = std::max(largest, position(v).length());
        tolerance_ = std::max(place_tolerance * size_, rounding * largest);
        // What is as narrow as the tolerance is no plane either
        if (!std::isfinite(largest) || !(normal.length() > 16.0 * tolerance_ * size_)) return false;
        plane_ = {origin, x / size_, {}, normal / normal.length()};
        plane_.y = plane_.normal.cross(plane_.x);
        return true;
    }

    bool lies_in_plane() const {
        const auto is_on = [&](const Vec3d& p) { return std::abs(plane_.height(p)) <= tolerance_; };
        return std::all_of(vertices_.begin(), vertices_.end(),
                           [&](uint32_t v) { return is_on(position(v)); }) &&
               std::all_of(outline_.begin(), outline_.end(), is_on);
    }

    /// Whether the triangles cover the convex polygon of the corners and no more: then its sides
    /// are straight.
    bool fills_outline() const {
        std::vector<Vec2d> points;
        for (const Vec3d& p : outline_) points.push_back(plane_.place(p));
        const std::vector<Vec2d> hull = convex_hull(std::move(points));
        if (hull.size() < 3) return false;
        double hull_area = 0, area = 0;
        for (size_t i = 0; i < hull.size(); ++i) {
            const Vec2d& a = hull[i];
            const Vec2d side = hull[(i + 1) % hull.size()] - a;
            hull_area += 0.5 * cross(a, side);
            for (const uint32_t v : vertices_)
                if (cross(side, plane_.place(position(v)) - a) < -4.0 * tolerance_ * side.length())
                    return false;
        }
        for (const uint32_t t : triangles_) {
            const auto& triangle = data_.triangles[t];
            const Vec3d p = position(triangle[0]);
            area += 0.5 * (position(triangle[1]) - p).cross(position(triangle[2]) - p).length();
        }
        return std::abs(area - hull_area) <= area_tolerance * hull_area;
    }

    /// Counter-clockwise. Ref: Andrew 1979, "Another Efficient Algorithm for Convex Hulls in Two
    /// Dimensions", Information Processing Letters 9(5).
    static std::vector<Vec2d> convex_hull(std::vector<Vec2d> points) {
        std::sort(points.begin(), points.end(), [](const Vec2d& a, const Vec2d& b) {
            return std::pair(a.x, a.y) < std::pair(b.x, b.y);
        });
        std::vector<Vec2d> hull;
        for (int half = 0; half < 2; ++half) {
            const size_t first = hull.size();
            for (const Vec2d& p : points) {
                while (hull.size() >= first + 2 &&
                       cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0)
                    hull.pop_back();
                hull.push_back(p);
            }
            hull.pop_back();  // the first of the other half
            std::reverse(points.begin(), points.end());
        }
        return hull;
    }

    bool has_one_normal() const {
        if (data_.normals.empty()) return true;
        const Vec3d first(data_.normals[vertices_.front()]);
        return std::abs(std::abs(first.dot(plane_.normal)) - 1.0) <= normal_tolerance &&
               std::all_of(vertices_.begin(), vertices_.end(), [&](uint32_t v) {
                   return (Vec3d(data_.normals[v]) - first).length() <= normal_tolerance;
               });
    }

    bool is_affine(const scene::Primvar& primvar) const {
        if (primvar.interpolation == scene::Interpolation::Constant ||
            primvar.interpolation == scene::Interpolation::Uniform)
            return true;
        const auto number = [&](uint32_t vertex, size_t k) {
            const size_t row = primvar.indices.empty() ? vertex : primvar.indices[vertex];
            return double(primvar.values[row * primvar.width + k]);
        };
        const Vec2d a = plane_.place(position(base_[1]));
        const Vec2d b = plane_.place(position(base_[2]));
        for (size_t k = 0; k < primvar.width; ++k) {
            double low = number(base_[0], k), high = low, largest = 0;
            for (const uint32_t v : vertices_) {
                low = std::min(low, number(v, k));
                high = std::max(high, number(v, k));
                largest = std::max(largest, std::abs(number(v, k)));
            }
            const double tolerance = std::max(primvar_tolerance * (high - low), rounding * largest);
            const double start = number(base_[0], k);
            for (const uint32_t v : vertices_) {
                const Vec2d p = plane_.place(position(v));
                const double expected = start +
                                        cross(p, b) / cross(a, b) * (number(base_[1], k) - start) +
                                        cross(a, p) / cross(a, b) * (number(base_[2], k) - start);
                if (!(std::abs(number(v, k) - expected) <= tolerance)) return false;
            }
        }
        return true;
    }

    const TriangleMeshData& data_;
    std::span<const uint32_t> triangles_;
    std::vector<Vec3d> outline_;
    std::vector<uint32_t> vertices_;
    uint32_t base_[3] = {};
    Plane plane_;
    double size_ = 0, tolerance_ = 0;
};

/// [face] the first of its corners, and one past the last of all.
std::vector<size_t> first_corners(const scene::Mesh& mesh) {
    std::vector<size_t> first = {0};
    for (const uint32_t count : mesh.face_vertex_counts) first.push_back(first.back() + count);
    return first;
}

}  // namespace

std::vector<uint8_t> flat_faces(const scene::Mesh& mesh,
                                const LimitSurface& surface,
                                std::span<const uint32_t> rates) {
    if (!mesh.later_points.empty()) return {};
    const std::vector<size_t> first = first_corners(mesh);
    const std::span<const uint32_t> edges = surface.edge_of_corner();
    std::vector<uint8_t> is_candidate(mesh.face_vertex_counts.size(), 0);
    std::vector<uint32_t> trial_rates(surface.edge_count(), 1);
    for (size_t f = 0; f < is_candidate.size(); ++f) {
        const auto of_face = edges.subspan(first[f], first[f + 1] - first[f]);
        is_candidate[f] = surface.has_face()[f] != 0 &&
                          estimated_triangles(mesh.subdivision, of_face, rates) >= min_triangles;
        if (is_candidate[f])
            for (const uint32_t e : of_face) trial_rates[e] = trial_pieces;
    }
    if (std::none_of(is_candidate.begin(), is_candidate.end(), [](uint8_t c) { return c != 0; }) ||
        double(estimated_triangles(mesh, surface, trial_rates)) >
            max_trial_share * double(estimated_triangles(mesh, surface, rates)))
        return {};
    const Result<DicedMesh> trial = surface.dice(trial_rates);
    if (!trial) return {};
    const TriangleMeshData& data = trial->data;

    // The triangles of each face, one face after the other
    std::vector<size_t> starts(is_candidate.size() + 1, 0);
    const auto face_of = [&](size_t t) { return data.faces.empty() ? t : data.faces[t]; };
    for (size_t t = 0; t < data.triangles.size(); ++t) ++starts[face_of(t) + 1];
    for (size_t f = 0; f < is_candidate.size(); ++f) starts[f + 1] += starts[f];
    std::vector<uint32_t> sorted(data.triangles.size());
    std::vector<size_t> next(starts.begin(), starts.end() - 1);
    for (size_t t = 0; t < data.triangles.size(); ++t) sorted[next[face_of(t)]++] = uint32_t(t);

    std::vector<uint8_t> is_flat(is_candidate.size(), 0);
    for (size_t f = 0; f < is_flat.size(); ++f) {
        if (is_candidate[f] == 0) continue;
        std::vector<Vec3d> outline;
        for (const uint32_t e : edges.subspan(first[f], first[f + 1] - first[f]))
            for (const size_t end : {0u, 2u}) outline.emplace_back(surface.edge_points()[e][end]);
        const std::span<const uint32_t> triangles(sorted.data() + starts[f],
                                                  starts[f + 1] - starts[f]);
        is_flat[f] = FaceTrial(data, triangles, std::move(outline)).is_flat();
    }
    return is_flat;
}

void spare_flat_edges(const scene::Mesh& mesh,
                      const LimitSurface& surface,
                      std::span<const uint8_t> is_flat,
                      std::span<uint32_t> rates) {
    if (is_flat.empty()) return;
    std::vector<uint8_t> is_needed(rates.size(), 0), has_flat(rates.size(), 0);
    const std::span<const uint32_t> edges = surface.edge_of_corner();
    size_t first = 0;
    for (size_t f = 0; f < is_flat.size(); ++f) {
        const size_t count = mesh.face_vertex_counts[f];
        if (surface.has_face()[f])
            for (const uint32_t e : edges.subspan(first, count))
                (is_flat[f] ? has_flat : is_needed)[e] = 1;
        first += count;
    }
    for (size_t e = 0; e < rates.size(); ++e)
        if (has_flat[e] && !is_needed[e]) rates[e] = 1;
}

}  // namespace velatura::geometry
