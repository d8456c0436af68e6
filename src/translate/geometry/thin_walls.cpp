// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/thin_walls.h"

#include "base/hash.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>

namespace velatura::translate::geometry {

namespace {

/// Points nearer than this, in diagonals of the mesh, are the same point.
constexpr double weld_distance = 1e-6;

using Cell = std::array<int64_t, 3>;

struct CellHash {
    size_t operator()(const Cell& cell) const {
        uint64_t h = 0;
        for (const int64_t c : cell) h = hash_combine(h, uint64_t(c));
        return size_t(h);
    }
};

/// Finds points near others by cells twice as wide as the distance.
class Welder {
  public:
    explicit Welder(double distance) : distance_(distance) {}

    /// The first point within the distance, which may be this one.
    uint32_t add(uint32_t index, const std::vector<Vec3>& points) {
        const Vec3d p(points[index]);
        Cell near, far;
        for (size_t k = 0; k < 3; ++k) {
            const double at = p[int(k)] / (2.0 * distance_), low = std::floor(at);
            near[k] = int64_t(low);
            far[k] = near[k] + (at - low < 0.5 ? -1 : 1);
        }
        for (unsigned corner = 0; corner < 8; ++corner) {
            Cell cell = near;
            for (size_t k = 0; k < 3; ++k)
                if (corner >> k & 1u) cell[k] = far[k];
            const auto found = first_.find(cell);
            if (found == first_.end()) continue;
            for (const uint32_t other : found->second)
                if ((Vec3d(points[other]) - p).length() <= distance_) return other;
        }
        first_[near].push_back(index);
        return index;
    }

  private:
    double distance_;
    std::unordered_map<Cell, std::vector<uint32_t>, CellHash> first_;
};

/// [point] the point that it is the same as.
std::vector<uint32_t> welded(const scene::Mesh& mesh) {
    std::vector<uint32_t> same(mesh.points.size());
    std::iota(same.begin(), same.end(), 0u);
    using enum scene::SubdivisionScheme;
    const bool is_smooth = mesh.subdivision == CatmullClark || mesh.subdivision == Loop;
    // There the faces along boundaries are gone, duplicated points or not
    if (is_smooth && mesh.rules.boundary == scene::BoundaryInterpolation::None) return same;
    Box3d box;
    double largest = 0;
    for (const uint32_t i : mesh.face_vertex_indices) {
        box.extendBy(Vec3d(mesh.points[i]));
        for (int k = 0; k < 3; ++k)
            largest = std::max(largest, std::abs(double(mesh.points[i][k])));
    }
    // Casts to float move points that were the same by a rounding each
    const double distance = std::max(weld_distance * box.size().length(), 0x1p-22 * largest);
    if (!(distance > 0.0)) return same;
    Welder welder(distance);
    std::vector<bool> is_done(mesh.points.size());
    for (const uint32_t i : mesh.face_vertex_indices) {
        if (is_done[i]) continue;
        is_done[i] = true;
        same[i] = welder.add(i, mesh.points);
    }
    return same;
}

/// Sets of faces that are joined.
class Pieces {
  public:
    explicit Pieces(size_t faces) : parent_(faces) {
        std::iota(parent_.begin(), parent_.end(), 0u);
    }

    uint32_t of(uint32_t face) {
        while (parent_[face] != face) face = parent_[face] = parent_[parent_[face]];
        return face;
    }

    void join(uint32_t a, uint32_t b) { parent_[of(a)] = of(b); }

  private:
    std::vector<uint32_t> parent_;
};

/// Whether the material takes what it is on for the border of a solid and would not lose by being a
/// thin wall: it says nothing of an inside, and what is inside differs in index.
bool can_be_sheet(const scene::Material& m) {
    const bool has_index_one = scene::is_constant(m.ior) && m.ior.value.x == 1.0f;
    return scene::can_transmit(m) && !m.thin_walled && !m.is_solid && !m.is_bare && !m.interior &&
           !(m.transmission_depth > 0.0f) && m.dielectric_priority == 0 &&
           !scene::can_scatter_below(m) && !has_index_one;
}

class ThinWalls {
  public:
    explicit ThinWalls(Context& ctx) : ctx_(ctx) {
        for (const scene::Material& m : ctx.scene.materials) is_sheet_.push_back(can_be_sheet(m));
    }

    void run() {
        if (std::none_of(is_sheet_.begin(), is_sheet_.end(), [](bool is) { return is; })) return;
        for (scene::Shape& shape : ctx_.scene.shapes) visit(shape);
        for (scene::Prototype& prototype : ctx_.scene.prototypes)
            for (scene::Shape& shape : prototype.shapes) visit(shape);
        for (const scene::Volume& volume : ctx_.scene.volumes)
            if (is_sheet(volume.surface.material)) uses_[volume.surface.material].is_solid = true;
        for (auto& [material, use] : uses_)
            if (use.sheets > 0) make_thin(material, use);
        for (Open& open : open_) set_materials(open);
        if (open_.empty()) return;
        ctx_.diagnostics.note(
            "thin-walls", {}, "",
            fmt::format(
                "{} taken as {} of materials that transmit: meshes with boundary edges are not "
                "closed; -v lists them; override with inputs:velatura:thinWalled",
                open_.size() == 1 ? "1 mesh is" : fmt::format("{} meshes are", open_.size()),
                open_.size() == 1 ? "a thin wall" : "thin walls"));
    }

  private:
    struct Use {
        bool is_solid = false;  ///< something closed has the material too
        size_t sheets = 0;
        scene::ProvenanceId first = scene::none;
        scene::MaterialId thin = scene::none;
    };

    /// A shape that is open, or some faces of which are.
    struct Open {
        scene::Shape* shape;
        std::vector<bool> faces;  ///< empty: all
    };

    bool is_sheet(scene::MaterialId m) const { return m < is_sheet_.size() && is_sheet_[m]; }

    void visit(scene::Shape& shape) {
        if (auto* mesh = std::get_if<scene::Mesh>(&shape.geometry)) {
            visit_mesh(shape, *mesh);
            return;
        }
        if (!is_sheet(shape.material)) return;
        const auto* gprim = std::get_if<scene::Gprim>(&shape.geometry);
        const auto* curves = std::get_if<scene::Curves>(&shape.geometry);
        const bool is_open = (gprim && gprim->kind == scene::Gprim::Kind::Plane) ||
                             (curves && !curves->normals.empty());
        Use& use = uses_[shape.material];
        if (!is_open) {
            use.is_solid = true;
            return;
        }
        count(use, shape);
        open_.push_back({&shape, {}});
    }

    void visit_mesh(scene::Shape& shape, const scene::Mesh& mesh) {
        const size_t faces = mesh.face_vertex_counts.size();
        const auto material = [&](size_t face) {
            return mesh.face_materials.empty() ? shape.material : mesh.face_materials[face];
        };
        bool is_asked = mesh.face_materials.empty() && is_sheet(shape.material);
        for (const scene::MaterialId m : mesh.face_materials) is_asked = is_asked || is_sheet(m);
        if (!is_asked) return;
        std::vector<bool> is_open = open_faces(mesh);
        std::map<scene::MaterialId, bool> sheets;  // whether some face is one
        for (size_t f = 0; f < faces; ++f) {
            if (!is_sheet(material(f))) continue;
            if (is_open[f])
                sheets[material(f)] = true;
            else
                uses_[material(f)].is_solid = true;
        }
        for (const auto& [m, is] : sheets) count(uses_[m], shape);
        if (!sheets.empty()) open_.push_back({&shape, std::move(is_open)});
    }

    static void count(Use& use, const scene::Shape& shape) {
        if (use.sheets++ == 0) use.first = shape.provenance;
    }

    void make_thin(scene::MaterialId material, Use& use) {
        use.thin = material;
        if (use.is_solid) {
            use.thin = scene::MaterialId(ctx_.scene.materials.size());
            ctx_.scene.materials.push_back(scene::Material(ctx_.scene.materials[material]));
        }
        scene::Material& m = ctx_.scene.materials[use.thin];
        m.thin_walled = m.is_open_sheet = true;
        const scene::Provenance& where = ctx_.scene.provenance[use.first];
        const std::string others =
            use.sheets > 1 ? fmt::format(" and {} more", use.sheets - 1) : std::string();
        ctx_.diagnostics.note(
            "thin-wall", where.loc, where.prim_path,
            fmt::format("<{}>{} with <{}> {} boundary edges: rendered as thin walls, without "
                        "refraction; inputs:velatura:thinWalled = 0 makes them solids",
                        where.prim_path, others, m.name, use.sheets > 1 ? "have" : "has"));
    }

    void set_materials(Open& open) {
        const auto thin = [&](scene::MaterialId m) {
            const auto found = uses_.find(m);
            return found != uses_.end() && found->second.thin != scene::none ? found->second.thin
                                                                             : m;
        };
        auto* mesh = std::get_if<scene::Mesh>(&open.shape->geometry);
        const auto is_one = [](bool is) { return is; };
        const bool is_whole = std::all_of(open.faces.begin(), open.faces.end(), is_one);
        if (mesh == nullptr || (mesh->face_materials.empty() && is_whole)) {
            open.shape->material = thin(open.shape->material);
            return;
        }
        if (mesh->face_materials.empty())
            mesh->face_materials.assign(mesh->face_vertex_counts.size(), open.shape->material);
        for (size_t f = 0; f < open.faces.size(); ++f)
            if (open.faces[f]) mesh->face_materials[f] = thin(mesh->face_materials[f]);
    }

    Context& ctx_;
    std::vector<bool> is_sheet_;  // [material] as translated
    std::map<scene::MaterialId, Use> uses_;
    std::vector<Open> open_;
};

}  // namespace

std::vector<bool> open_faces(const scene::Mesh& mesh) {
    const std::vector<uint32_t> same = welded(mesh);
    const size_t count = mesh.face_vertex_counts.size();
    std::vector<bool> is_hole(count);
    for (const uint32_t hole : mesh.rules.holes)
        if (hole < count) is_hole[hole] = true;
    Pieces pieces(count);
    std::vector<std::pair<uint64_t, uint32_t>> edges;  // both ends, face
    std::unordered_map<uint64_t, uint32_t> known;      // faces by their points
    size_t first = 0;
    for (uint32_t f = 0; f < count; ++f) {
        const auto authored =
            std::span(mesh.face_vertex_indices).subspan(first, mesh.face_vertex_counts[f]);
        first += authored.size();
        if (is_hole[f]) continue;
        std::vector<uint32_t> corners;
        for (const uint32_t i : authored) corners.push_back(same[i]);
        std::vector<uint32_t> sorted = corners;
        std::sort(sorted.begin(), sorted.end());
        uint64_t points = sorted.size();
        for (const uint32_t i : sorted) points = hash_combine(points, i);
        const auto [twin, is_new] = known.try_emplace(points, f);
        if (!is_new) {
            // A sheet and its back are one
            pieces.join(f, twin->second);
            continue;
        }
        for (size_t k = 0; k < corners.size(); ++k) {
            const uint32_t a = corners[k], b = corners[(k + 1) % corners.size()];
            if (a != b) edges.emplace_back(uint64_t(std::min(a, b)) << 32 | std::max(a, b), f);
        }
    }
    std::sort(edges.begin(), edges.end());
    std::vector<uint32_t> at_boundary;
    for (size_t i = 0; i < edges.size();) {
        size_t end = i + 1;
        for (; end < edges.size() && edges[end].first == edges[i].first; ++end)
            pieces.join(edges[i].second, edges[end].second);
        if (end == i + 1) at_boundary.push_back(edges[i].second);
        i = end;
    }
    std::vector<bool> is_open_piece(count), is_open(count);
    for (const uint32_t f : at_boundary) is_open_piece[pieces.of(f)] = true;
    for (uint32_t f = 0; f < count; ++f) is_open[f] = is_open_piece[pieces.of(f)];
    return is_open;
}

void find_thin_walls(Context& ctx) {
    ThinWalls(ctx).run();
}

}  // namespace velatura::translate::geometry
