// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/geometry_set.h"
#include "light_fixtures.h"
#include "lights/emissive_surfaces.h"
#include "lights/light_selector.h"
#include "shading/material_evaluator.h"

#include <memory>
#include <vector>

namespace velatura::lights {

/// A scene with emissive surfaces, ready to be sampled once prepare() was called.
struct EmissiveStage {
    scene::Scene scene = scene_of({});
    Diagnostics diagnostics;
    std::unique_ptr<geometry::GeometrySet> geometry;
    std::unique_ptr<shading::MaterialEvaluator> materials;
    std::unique_ptr<LightSet> lights;

    scene::MaterialId add_material(const Rgb& emission) {
        scene::Material material;
        material.name = "/Material";
        material.emissive_color = scene::Input(emission);
        scene.materials.push_back(material);
        return scene::MaterialId(scene.materials.size() - 1);
    }

    static scene::Shape triangles(const std::vector<Vec3>& points, scene::MaterialId material) {
        scene::Mesh mesh;
        mesh.points = points;
        for (uint32_t i = 0; i < points.size(); ++i) mesh.face_vertex_indices.push_back(i);
        mesh.face_vertex_counts.assign(points.size() / 3, 3);
        scene::Shape shape;
        shape.geometry = mesh;
        shape.material = material;
        return shape;
    }

    void add_instance(uint32_t prototype, const Mat4& m) {
        scene::Instance instance;
        instance.prototype = prototype;
        instance.render_from_prototype = m;
        scene.instances.push_back(instance);
    }

    const LightSet& prepare() {
        lights.reset();
        geometry = std::make_unique<geometry::GeometrySet>(scene);
        materials = std::make_unique<shading::MaterialEvaluator>(scene, diagnostics);
        lights = std::make_unique<LightSet>(
            scene, ImageLoader(), diagnostics,
            LightSetOptions{.geometry = geometry.get(), .materials = materials.get()});
        return *lights;
    }

    /// Every light and every emissive triangle.
    std::vector<LightId> all() const {
        std::vector<LightId> ids;
        for (uint32_t i = 0; i < lights->item_count(); ++i) {
            const uint32_t parts =
                lights->is_surface(i) ? lights->surfaces()->part_count(i - lights->size()) : 1;
            for (uint32_t part = 0; part < parts; ++part) ids.push_back(LightId(i, part));
        }
        return ids;
    }
};

}  // namespace velatura::lights
