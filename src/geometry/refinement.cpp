// SPDX-License-Identifier: Apache-2.0
#include "geometry/refinement.h"

#include "base/box.h"
#include "base/tasks.h"
#include "geometry/flat_faces.h"
#include "geometry/shape_list.h"
#include "geometry/tessellate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

namespace velatura::geometry {

namespace {

/// A mesh on its way.
struct Job {
    ListedShape listed;
    const scene::Mesh* mesh = nullptr;
    std::optional<Mat4d> render_from_shape;  ///< nothing: stands nowhere
    std::unique_ptr<LimitSurface> surface;
    std::vector<uint32_t> rates;
    std::optional<std::vector<uint8_t>> is_flat;  ///< [face], see flat_faces.h; not yet known
    std::string error;
    bool is_refined = false, is_displaced = false;
};

bool is_subdivided(const scene::Shape& shape) {
    const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
    return mesh != nullptr && mesh->subdivision != scene::SubdivisionScheme::None;
}

Box3d bounds_of(const scene::Prototype& prototype) {
    Box3d box;
    for (const scene::Shape& shape : prototype.shapes) {
        if (!is_subdivided(shape)) continue;
        const auto& mesh = std::get<scene::Mesh>(shape.geometry);
        for (const uint32_t i : mesh.face_vertex_indices) box.extendBy(Vec3d(mesh.points[i]));
    }
    return box;
}

/// How large a box of a prototype gets in the image under the matrix, at its nearest point.
double extent_in_image(const Box3d& box, const Mat4d& m, const DicingView& view) {
    const Box3d placed = transformed(box, m);
    Vec3d nearest;
    for (int k = 0; k < 3; ++k) nearest[k] = std::clamp(0.0, placed.min[k], placed.max[k]);
    const double pixels = view.density(nearest) * (placed.max - placed.min).length();
    return view.can_show(placed) ? pixels : pixels / unseen_factor;
}

/// [prototype] the matrix of the instance in which it is largest in the image.
std::vector<std::optional<Mat4d>> largest_instances(const scene::Scene& scene,
                                                    const DicingView& view) {
    std::vector<std::optional<Mat4d>> matrices(scene.prototypes.size());
    std::vector<double> extents(scene.prototypes.size(), -1.0);
    std::vector<Box3d> boxes;
    for (const scene::Prototype& prototype : scene.prototypes)
        boxes.push_back(bounds_of(prototype));
    for (const scene::Instance& instance : scene.instances) {
        const uint32_t p = instance.prototype;
        if (boxes[p].isEmpty()) continue;
        const Mat4d matrix(instance.render_from_prototype);
        const double extent = extent_in_image(boxes[p], matrix, view);
        if (!(extent > extents[p])) continue;
        extents[p] = extent;
        matrices[p] = matrix;
    }
    return matrices;
}

std::vector<Job> make_jobs(const scene::Scene& scene,
                           const RefinementTools& tools,
                           const DicingView& view) {
    const std::vector<std::optional<Mat4d>> matrices = largest_instances(scene, view);
    std::vector<Job> jobs;
    for (const ListedShape& listed : list_shapes(scene)) {
        const bool is_moved = tools.displacer && is_displaced(*listed.shape, *tools.displacer);
        const bool is_refined = tools.subdivider && is_subdivided(*listed.shape);
        if (!is_moved && !is_refined) continue;
        Job& job = jobs.emplace_back();
        job.listed = listed;
        job.mesh = &std::get<scene::Mesh>(listed.shape->geometry);
        job.is_displaced = is_moved;
        job.is_refined = is_refined;
        job.render_from_shape =
            listed.prototype == scene::none ? Mat4d() : matrices[listed.prototype];
    }
    parallel_for(jobs.size(), [&](size_t i) {
        Job& job = jobs[i];
        if (!job.is_refined) return;
        auto surface = tools.subdivider->make(*job.mesh, false);
        if (surface)
            job.surface = *std::move(surface);
        else
            job.error = surface.error().message;
    });
    return jobs;
}

/// Chooses how many pieces edges get, `max` at most; returns about how many triangles that makes.
uint64_t set_rates(std::vector<Job>& jobs,
                   const DicingView& view,
                   std::optional<int> level,
                   double rate,
                   uint32_t max) {
    std::vector<uint64_t> triangles(jobs.size(), 0);
    parallel_for(jobs.size(), [&](size_t i) {
        Job& job = jobs[i];
        if (!job.surface) return;
        if (level || !job.render_from_shape) {
            job.rates.assign(job.surface->edge_count(), 1u << (level ? *level : 0));
        } else {
            job.rates = edge_rates(*job.mesh, *job.surface, view, *job.render_from_shape,
                                   job.listed.is_light ? rate * light_factor : rate, max);
            // What displacement moves is flat no more, and lights are chosen triangle by triangle:
            // a bright spot of a texture wants small ones
            if (!job.is_flat)
                job.is_flat = job.is_displaced || job.listed.is_light
                                  ? std::vector<uint8_t>()
                                  : flat_faces(*job.mesh, *job.surface, job.rates);
            spare_flat_edges(*job.mesh, *job.surface, *job.is_flat, job.rates);
        }
        triangles[i] = estimated_triangles(*job.mesh, *job.surface, job.rates);
    });
    uint64_t total = 0;
    for (const uint64_t count : triangles) total += count;
    return total;
}

/// Chooses rates for all meshes together, within the limit.
void choose_rates(std::vector<Job>& jobs,
                  const DicingOptions& options,
                  const DicingView& view,
                  RefinementStats& stats,
                  Diagnostics& diagnostics) {
    std::optional<int> level = options.level;
    double rate = options.rate;
    const uint64_t wanted = set_rates(jobs, view, level, rate, max_pieces);
    uint64_t total = wanted;
    constexpr int max_rounds = 64;
    for (int i = 0; i < max_rounds && total > options.max_triangles; ++i) {
        if (level && *level == 0) break;
        if (level)
            --*level;
        else
            rate *= std::max(1.1, std::sqrt(double(total) / double(options.max_triangles)));
        // Edges with more pixels than any rate would bring down (at the camera they are infinite)
        // get fewer pieces too
        const auto max = uint32_t(std::max(1.0, max_pieces * (options.rate / rate)));
        total = set_rates(jobs, view, level, rate, max);
    }
    stats.rate = level ? 0 : rate;
    stats.level = level ? *level : -1;
    if (wanted <= options.max_triangles) return;
    const std::string instead = level ? fmt::format("level {} is used", *level)
                                      : fmt::format("{:.2f} pixels per edge are used", rate);
    diagnostics.warn("dicing-limit", {}, {},
                     fmt::format("subdivision surfaces need about {} million triangles, above the "
                                 "limit of {}; {} instead; raise --dicing-limit",
                                 wanted / 1'000'000, options.max_triangles / 1'000'000, instead));
}

/// The triangles of a job, each surface gone once it is cut; nothing for polygons that stay as they
/// are.
std::optional<DicedMesh> diced(Job& job) {
    if (job.surface) {
        Result<DicedMesh> cut = job.surface->dice(job.rates);
        job.surface.reset();
        if (cut) return *std::move(cut);
        job.error = cut.error().message;
    }
    if (!job.is_displaced) return std::nullopt;
    return DicedMesh{make_triangles(*job.listed.shape, {}), {}};
}

void make_meshes(std::vector<Job>& jobs, const Displacer* displacer, Refinement& out) {
    parallel_for(jobs.size(), [&](size_t i) {
        Job& job = jobs[i];
        std::optional<DicedMesh> mesh = diced(job);
        if (!mesh) return;
        if (job.is_displaced)
            mesh->data = displaced(std::move(mesh->data), mesh->twins, *job.listed.shape,
                                   *displacer, job.render_from_shape.value_or(Mat4d()));
        Refinement::Meshes& meshes =
            job.listed.prototype == scene::none ? out.shapes : out.prototypes[job.listed.prototype];
        meshes[job.listed.index] = std::move(mesh->data);
    });
}

void count(const Job& job, Refinement& out) {
    out.stats.displaced += job.is_displaced;
    if (!job.is_refined) return;
    if (!job.error.empty()) {
        ++out.stats.polygon_meshes;
        return;
    }
    const TriangleMeshData& data = **out.find(job.listed.prototype, job.listed.index);
    ++out.stats.meshes;
    out.stats.faces += job.mesh->face_vertex_counts.size();
    out.stats.triangles += data.triangles.size();
    out.stats.bytes += bytes_of(data);
}

/// Says what became of each mesh, in the order of the scene.
void report(const scene::Scene& scene,
            const std::vector<Job>& jobs,
            Refinement& out,
            Diagnostics& diagnostics) {
    for (const Job& job : jobs) {
        count(job, out);
        const scene::ProvenanceId id = job.listed.shape->provenance;
        const scene::Provenance where =
            id < scene.provenance.size() ? scene.provenance[id] : scene::Provenance();
        const bool is_polygons = !job.is_refined || !job.error.empty();
        if (!job.error.empty())
            diagnostics.warn("subdivision", where.loc, where.prim_path,
                             fmt::format("{}; the mesh is rendered unsubdivided", job.error));
        if (job.is_displaced && is_polygons)
            diagnostics.warn("displacement", where.loc, where.prim_path,
                             fmt::format("displacement moves only the {} points of the mesh; "
                                         "subdivide the mesh for finer displacement",
                                         job.mesh->points.size()));
    }
}

}  // namespace

const scene::Shape* first_subdivided(const scene::Scene& scene) {
    for (const ListedShape& listed : list_shapes(scene))
        if (is_subdivided(*listed.shape)) return listed.shape;
    return nullptr;
}

Refinement refine(const scene::Scene& scene,
                  const RefinementTools& tools,
                  const DicingOptions& options,
                  const DicingView& view,
                  Diagnostics& diagnostics) {
    const auto start = std::chrono::steady_clock::now();
    Refinement out;
    out.shapes.resize(scene.shapes.size());
    for (const scene::Prototype& prototype : scene.prototypes)
        out.prototypes.emplace_back(prototype.shapes.size());
    std::vector<Job> jobs = make_jobs(scene, tools, view);
    choose_rates(jobs, options, view, out.stats, diagnostics);
    make_meshes(jobs, tools.displacer, out);
    report(scene, jobs, out, diagnostics);
    out.stats.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

}  // namespace velatura::geometry
