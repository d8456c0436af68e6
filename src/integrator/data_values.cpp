// SPDX-License-Identifier: Apache-2.0
#include "integrator/data_values.h"

#include "geometry/triangle_mesh.h"

#include <array>
#include <limits>

namespace velatura::integrator {

using accumulate::DataSource;
using accumulate::PickedValue;

namespace {

void set(PickedValue& value, const Vec3& v) {
    value.values = {v.x, v.y, v.z, 0.0f};
    value.is_there = true;
}

void set(PickedValue& value, const std::optional<Vec2>& v) {
    if (!v) return;
    value.values = {v->x, v->y, 0.0f, 0.0f};
    value.is_there = true;
}

Vec3 world_position(const World& world, const Vec3& p) {
    return to_float(Vec3d(p) + world.scene.camera.world_position);
}

}  // namespace

DataValues::DataValues(const World& world, const film::LayerSet& layers) : world_(world) {
    for (const accumulate::DataLayer& d : layers.named_data) {
        Layer layer{d.source};
        if (d.source == DataSource::Primvar)
            layer.primvar = scene::find_primvar(world.scene, d.primvar);
        for (int g = 0; g < layers.group_count(); ++g)
            if (!d.group.empty() && layers.groups[size_t(g)].name == d.group) layer.group = g;
        layers_.push_back(layer);
    }
    if (layers.has_motion_data()) motion_.emplace(world);
}

void DataValues::record_surface(const geometry::SurfacePoint& point,
                                const Vec3& ns,
                                const Rgb& albedo,
                                film::SampleRadiance& out) const {
    const float depth = world_.camera.depth(point.p);
    for (size_t i = 0; i < layers_.size(); ++i) {
        PickedValue& value = out.data[i];
        value.depth = depth;
        switch (layers_[i].source) {
            case DataSource::Primvar:
                value.is_there =
                    geometry::primvar(world_.scene, point, layers_[i].primvar, value.values.data());
                break;
            case DataSource::Albedo:
                set(value, albedo);
                break;
            case DataSource::Normal:
                set(value, ns);
                break;
            case DataSource::EyeNormal:
                set(value, to_float(world_.camera.normal_to_camera(Vec3d(ns))));
                break;
            case DataSource::FacetNormal:
                set(value, point.ng);
                break;
            case DataSource::Position:
                set(value, world_position(world_, point.p));
                break;
            case DataSource::EyePosition:
                set(value, to_float(world_.camera.to_camera(Vec3d(point.p))));
                break;
            case DataSource::Depth:
                set(value, Vec3(depth, 0.0f, 0.0f));
                break;
            case DataSource::Texture:
                value.is_there =
                    point.mesh->primvar(point.mesh->texture_coordinates(), point.triangle, point.b1,
                                        point.b2, value.values.data());
                break;
            case DataSource::Element:
                set(value, Vec3(float(point.face), 0.0f, 0.0f));
                break;
            case DataSource::Catcher:
            case DataSource::Plate:
                break;
            case DataSource::Motion:
            case DataSource::BackwardMotion:
            case DataSource::ShutterMotion:
                set(value, motion_->of_surface(layers_[i].source, point));
                break;
        }
    }
}

void DataValues::record_collision(const Vec3& p,
                                  const Rgb& albedo,
                                  film::SampleRadiance& out) const {
    const float depth = world_.camera.depth(p);
    for (size_t i = 0; i < layers_.size(); ++i) {
        PickedValue& value = out.data[i];
        value.depth = depth;
        const DataSource source = layers_[i].source;
        if (source == DataSource::Albedo) set(value, albedo);
        if (source == DataSource::Position) set(value, world_position(world_, p));
        if (source == DataSource::EyePosition)
            set(value, to_float(world_.camera.to_camera(Vec3d(p))));
        if (source == DataSource::Depth) set(value, Vec3(depth, 0.0f, 0.0f));
        if (source >= DataSource::Motion) set(value, motion_->of_place(source, p));
    }
}

void DataValues::record_catcher(film::SampleRadiance& out) const {
    for (size_t i = 0; i < layers_.size(); ++i) {
        const Layer& layer = layers_[i];
        if (layer.source != DataSource::Catcher && layer.source != DataSource::Plate) continue;
        const film::SampleRadiance& light =
            layer.source == DataSource::Catcher ? out.catcher() : out.plate();
        const Rgb radiance =
            layer.group == all_groups ? light.radiance() : light.radiance_of(layer.group);
        set(out.data[i], Vec3(radiance));
    }
}

void DataValues::record_background(const Vec3& direction, film::SampleRadiance& out) const {
    for (size_t i = 0; i < layers_.size(); ++i) {
        if (layers_[i].source < DataSource::Motion) continue;
        out.data[i].depth = std::numeric_limits<float>::infinity();
        set(out.data[i], motion_->of_direction(layers_[i].source, direction));
    }
}

}  // namespace velatura::integrator
