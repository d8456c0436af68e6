// SPDX-License-Identifier: Apache-2.0
#include "render/scene_compare.h"

#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace velatura::render {

namespace {

// The members of a struct. A binding that names too few or too many does not compile: no member is
// forgotten when one is added.

auto members(const scene::Input& v) {
    const auto& [a, b, c, d, e, f] = v;
    return std::tie(a, b, c, d, e, f);
}

auto members(const scene::ThinFilmInputs& v) {
    const auto& [a, b, c, d] = v;
    return std::tie(a, b, c, d);
}

auto members(const scene::MaterialXInputs& v) {
    const auto& [a, b, c, d, e, f, g, h, i] = v;
    return std::tie(a, b, c, d, e, f, g, h, i);
}

auto members(const scene::Hair& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k);
}

auto members(const scene::MediumProperties& v) {
    const auto& [a, b, c] = v;
    return std::tie(a, b, c);
}

auto members(const scene::Material& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, w, x, y, z, a2, b2,
                 c2, d2, e2, f2, g2, h2, i2, j2, k2, l2, m2, n2] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, w, x, y, z, a2,
                    b2, c2, d2, e2, f2, g2, h2, i2, j2, k2, l2, m2, n2);
}

auto members(const scene::Primvar& v) {
    const auto& [a, b, c, d, e, f] = v;
    return std::tie(a, b, c, d, e, f);
}

auto members(const scene::SubdivisionRules& v) {
    const auto& [a, b, c, d, e, f, g, h] = v;
    return std::tie(a, b, c, d, e, f, g, h);
}

auto members(const scene::Mesh& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l);
}

auto members(const scene::Gprim& v) {
    const auto& [a, b, c, d, e, f, g, h] = v;
    return std::tie(a, b, c, d, e, f, g, h);
}

auto members(const scene::Curves& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j);
}

auto members(const scene::Points& v) {
    const auto& [a, b, c, d] = v;
    return std::tie(a, b, c, d);
}

auto members(const scene::LevelSet& v) {
    const auto& [a, b, c] = v;
    return std::tie(a, b, c);
}

auto members(const scene::Shape& v) {
    const auto& [a, b, c, d, e, f, g] = v;
    return std::tie(a, b, c, d, e, f, g);
}

auto members(const scene::Prototype& v) {
    const auto& [a, b] = v;
    return std::tie(a, b);
}

auto members(const scene::Instance& v) {
    const auto& [a, b, c, d, e, f, g, h] = v;
    return std::tie(a, b, c, d, e, f, g, h);
}

auto members(const scene::InstanceValue& v) {
    const auto& [a, b, c, d] = v;
    return std::tie(a, b, c, d);
}

auto members(const scene::ColorDecoding& v) {
    const auto& [a, b, c, d, e] = v;
    return std::tie(a, b, c, d, e);
}

auto members(const scene::TexelColors& v) {
    const auto& [a, b] = v;
    return std::tie(a, b);
}

auto members(const scene::Texture& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n);
}

auto members(const scene::PatternStep& v) {
    const auto& [a, b, c, d] = v;
    return std::tie(a, b, c, d);
}

auto members(const scene::Pattern& v) {
    const auto& [a, b] = v;
    return std::tie(a, b);
}

auto members(const scene::IesProfile& v) {
    const auto& [a, b, c] = v;
    return std::tie(a, b, c);
}

auto members(const scene::Shaping& v) {
    const auto& [a, b, c, d, e, f, g, h] = v;
    return std::tie(a, b, c, d, e, f, g, h);
}

auto members(const scene::LightLinks& v) {
    const auto& [a, b, c, d, e, f] = v;
    return std::tie(a, b, c, d, e, f);
}

auto members(const scene::RoundedBox& v) {
    const auto& [a, b, c, d, e, f, g] = v;
    return std::tie(a, b, c, d, e, f, g);
}

auto members(const scene::FilterProjection& v) {
    const auto& [a, b, c] = v;
    return std::tie(a, b, c);
}

auto members(const scene::IntensityFilter&) {
    return std::tie();
}

auto members(const scene::RampFilter& v) {
    const auto& [a, b, c, d, e, f] = v;
    return std::tie(a, b, c, d, e, f);
}

auto members(const scene::RodFilter& v) {
    const auto& [a] = v;
    return std::tie(a);
}

auto members(const scene::BarnDoorFilter& v) {
    const auto& [a, b, c, d] = v;
    return std::tie(a, b, c, d);
}

auto members(const scene::GoboFilter& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j);
}

auto members(const scene::LightFilter& v) {
    const auto& [a, b, c, d, e, f, g] = v;
    return std::tie(a, b, c, d, e, f, g);
}

auto members(const scene::Light& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, w, x] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, w, x);
}

auto members(const scene::MeshLight& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n);
}

auto members(const scene::LightGroup& v) {
    const auto& [a, b, c, d] = v;
    return std::tie(a, b, c, d);
}

auto members(const scene::Linking& v) {
    const auto& [a, b, c, d, e, f] = v;
    return std::tie(a, b, c, d, e, f);
}

auto members(const scene::Caster& v) {
    const auto& [a, b] = v;
    return std::tie(a, b);
}

auto members(const scene::Casters& v) {
    const auto& [a, b, c, d, e] = v;
    return std::tie(a, b, c, d, e);
}

auto members(const scene::Camera& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t);
}

auto members(const scene::VolumeOptics& v) {
    const auto& [a, b, c, d, e, f, g, h] = v;
    return std::tie(a, b, c, d, e, f, g, h);
}

auto members(const scene::Volume& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m);
}

/// Not the grid itself: it is that of the file.
auto members(const scene::VolumeField& v) {
    const auto& [a, b, c, d, e, f, g, voxels] = v;
    (void)voxels;
    return std::tie(a, b, c, d, e, f, g);
}

auto members(const scene::VoxelGrid::Brick& v) {
    const auto& [a, b, c] = v;
    return std::tie(a, b, c);
}

auto members(const scene::VoxelGrid& v) {
    const auto& [a, b, c, d, e, f, g, h, i, j] = v;
    return std::tie(a, b, c, d, e, f, g, h, i, j);
}

auto members(const scene::RenderVar& v) {
    const auto& [a, b, c, d, e, f] = v;
    return std::tie(a, b, c, d, e, f);
}

auto members(const scene::RenderProduct& v) {
    const auto& [a, b, c, d] = v;
    return std::tie(a, b, c, d);
}

/// Not the size of the image.
auto members(const scene::RenderSettings& v) {
    const auto& [a, pass, b, width, height, c, d, e, f, g, space, h, i, j, k, l] = v;
    (void)width, (void)height;
    return std::tie(a, pass, b, c, d, e, f, g, space, h, i, j, k, l);
}

/// Not the place in a file.
auto members(const scene::Provenance& v) {
    const auto& [a, loc, b] = v;
    (void)loc;
    return std::tie(a, b);
}

template <class T>
concept Struct = requires(const T& v) {
    members(v);
};

/// Numbers without padding between them.
template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_same_v<T, Vec2> ||
    std::is_same_v<T, Vec3> || std::is_same_v<T, Vec3d> || std::is_same_v<T, Rgb> ||
    std::is_same_v<T, Mat4> || std::is_same_v<T, Mat4d> || std::is_same_v<T, Box3d> ||
    std::is_same_v<T, scene::Vec3i> || std::is_same_v<T, scene::PatternValue>;

template <class T>
bool same(const T& a, const T& b);
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b);

bool same(const std::string& a, const std::string& b) {
    return a == b;
}

bool same(const scene::LinkSet& a, const scene::LinkSet& b) {
    return a == b;
}

template <class T, size_t n>
bool same(const std::array<T, n>& a, const std::array<T, n>& b) {
    for (size_t i = 0; i < n; ++i)
        if (!same(a[i], b[i])) return false;
    return true;
}

template <class T, size_t n>
bool same(const T (&a)[n], const T (&b)[n]) {
    for (size_t i = 0; i < n; ++i)
        if (!same(a[i], b[i])) return false;
    return true;
}

template <class T>
bool same(const std::optional<T>& a, const std::optional<T>& b) {
    return a.has_value() == b.has_value() && (!a || same(*a, *b));
}

template <class T>
bool same(const std::shared_ptr<const T>& a, const std::shared_ptr<const T>& b) {
    return a == b || (a && b && same(*a, *b));
}

template <class... T>
bool same(const std::variant<T...>& a, const std::variant<T...>& b) {
    if (a.index() != b.index()) return false;
    return std::visit(
        [&](const auto& value) { return same(value, std::get<std::decay_t<decltype(value)>>(b)); },
        a);
}

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
    if (a.size() != b.size()) return false;
    if constexpr (Plain<T>) {
        return a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
    } else {
        for (size_t i = 0; i < a.size(); ++i)
            if (!same(a[i], b[i])) return false;
        return true;
    }
}

template <class T>
bool same(const T& a, const T& b) {
    if constexpr (Plain<T>) {
        return std::memcmp(&a, &b, sizeof(T)) == 0;
    } else {
        static_assert(Struct<T>);
        const auto left = members(a), right = members(b);
        return [&]<size_t... i>(std::index_sequence<i...>) {
            return (same(std::get<i>(left), std::get<i>(right)) && ...);
        }
        (std::make_index_sequence<std::tuple_size_v<decltype(left)>>());
    }
}

}  // namespace

bool is_same(const scene::Shape& a, const scene::Shape& b) {
    return same(a, b);
}

bool is_same(const scene::Instance& a, const scene::Instance& b) {
    return same(a, b);
}

bool is_same(const scene::Material& a, const scene::Material& b) {
    return same(a, b);
}

bool is_same(const scene::Light& a, const scene::Light& b) {
    return same(a, b);
}

bool is_same(const scene::Camera& a, const scene::Camera& b) {
    return same(a, b);
}

const char* fixed_difference(const scene::Scene& x, const scene::Scene& y) {
    const auto& [a_shapes, a_prototypes, a_instances, a_materials, a_textures, a_patterns,
                 a_primvars, a_lights, a_mesh_lights, a_volumes, a_fields, a_linking, a_casters,
                 a_groups, a_camera, a_settings, a_provenance, a_assets, a_notes, a_moments,
                 a_found, a_unit, a_rate, a_values] = x;
    const auto& [b_shapes, b_prototypes, b_instances, b_materials, b_textures, b_patterns,
                 b_primvars, b_lights, b_mesh_lights, b_volumes, b_fields, b_linking, b_casters,
                 b_groups, b_camera, b_settings, b_provenance, b_assets, b_notes, b_moments,
                 b_found, b_unit, b_rate, b_values] = y;
    // What was found in the stage is for messages alone
    (void)a_notes, (void)b_notes, (void)a_found, (void)b_found;
    if (!a_moments.empty() || !b_moments.empty()) return "motion vectors";
    if (!same(a_camera.world_position, b_camera.world_position)) return "origin of render space";
    if (!same(a_settings, b_settings)) return "render settings";
    if (!same(a_unit, b_unit) || !same(a_rate, b_rate)) return "units of the stage";
    if (!same(a_provenance, b_provenance)) return "prims";
    if (!same(a_assets, b_assets)) return "names of assets";
    if (a_shapes.size() != b_shapes.size()) return "number of shapes";
    if (a_instances.size() != b_instances.size()) return "number of instances";
    if (a_materials.size() != b_materials.size()) return "number of materials";
    if (a_lights.size() != b_lights.size()) return "number of lights";
    if (!same(a_primvars, b_primvars)) return "names of primvars";
    if (!same(a_textures, b_textures)) return "textures";
    if (!same(a_patterns, b_patterns)) return "patterns";
    if (!same(a_groups, b_groups)) return "light groups";
    if (!same(a_mesh_lights, b_mesh_lights)) return "mesh lights";
    if (!same(a_linking, b_linking)) return "links";
    if (!same(a_casters, b_casters)) return "shadow casters";
    if (!same(a_fields, b_fields) || !same(a_volumes, b_volumes)) return "volumes";
    if (!same(a_values, b_values)) return "values of instances";
    if (!same(a_prototypes, b_prototypes)) return "prototypes";
    return nullptr;
}

}  // namespace velatura::render
