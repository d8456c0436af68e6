// SPDX-License-Identifier: Apache-2.0
#include "app/study_outlines.h"

#include "geometry/dicing.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace velatura::app {

namespace {

bool is_subdivided(const scene::Shape& shape) {
    const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
    return mesh != nullptr && mesh->subdivision != scene::SubdivisionScheme::None;
}

/// Adds the error of each edge of the mesh that may be in the image.
void add_edges(const geometry::TriangleMesh& mesh,
               const Mat4d& render_from_mesh,
               const geometry::DicingView& view,
               std::vector<float>& errors) {
    // A million edges tell as much as all
    const size_t step = mesh.triangle_count() / 300'000 + 1;
    for (size_t t = 0; t < mesh.triangle_count(); t += step) {
        Vec3d normals[3], corners[3];
        if (!mesh.corner_normals(uint32_t(t), normals)) continue;
        Box3d box;
        for (int k = 0; k < 3; ++k) {
            corners[k] = transform_point(Vec3d(mesh.corner(uint32_t(t), k)), render_from_mesh);
            box.extendBy(corners[k]);
        }
        if (!view.can_show(box)) continue;
        for (int k = 0; k < 3; ++k) {
            const Vec3d &a = corners[k], &b = corners[(k + 1) % 3];
            // Scales of instances are as good as even: angles are those of the mesh
            errors.push_back(float(arc_height(b - a, normals[k], normals[(k + 1) % 3]) *
                                   view.density((a + b) * 0.5)));
        }
    }
}

}  // namespace

double arc_height(const Vec3d& chord, const Vec3d& normal_a, const Vec3d& normal_b) {
    const double cosine =
        normal_a.dot(normal_b) / std::max(normal_a.length() * normal_b.length(), 1e-300);
    return 0.5 * chord.length() * std::tan(0.25 * std::acos(std::clamp(cosine, -1.0, 1.0)));
}

double outline_error_px(const integrator::World& world) {
    const scene::Scene& scene = world.scene;
    const geometry::DicingView view(scene.camera, scene.settings.width, scene.settings.height);
    std::vector<float> errors;
    for (size_t s = 0; s < scene.shapes.size(); ++s)
        if (is_subdivided(scene.shapes[s]))
            add_edges(world.geometry.shapes()[s], Mat4d(), view, errors);
    for (const geometry::InstanceTransform& i : world.geometry.instances()) {
        const std::vector<scene::Shape>& shapes = scene.prototypes[i.prototype].shapes;
        for (size_t s = 0; s < shapes.size(); ++s)
            if (is_subdivided(shapes[s]))
                add_edges(world.geometry.prototypes()[i.prototype][s],
                          Mat4d(i.render_from_prototype), view, errors);
    }
    if (errors.empty()) return 0;
    const auto high = errors.begin() + ptrdiff_t(double(errors.size() - 1) * 0.99);
    std::nth_element(errors.begin(), high, errors.end());
    return double(*high);
}

}  // namespace velatura::app
