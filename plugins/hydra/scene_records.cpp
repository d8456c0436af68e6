// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/scene_records.h"

#include <pxr/base/gf/quatf.h>
#include <pxr/base/gf/quath.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <utility>

namespace velatura::hydra {

using namespace PXR_NS;
using usd::layer::LayerBuilder;
using usd::layer::Path;
using usd::layer::Specifier;
using usd::layer::Token;
using usd::layer::Value;

namespace {

using Geometry = std::map<SdfPath, GeometryRecord>;
using Lights = std::map<SdfPath, LightRecord>;
using Instancers = std::map<SdfPath, InstancerRecord>;

/// What is placed by the same instances of an instancer.
struct PrototypeGroup {
    VtIntArray indices;
    std::vector<SdfPath> geometry, instancers;
};

/// Writes the records of one moment into a layer.
class LayerAuthor {
  public:
    LayerAuthor(const Geometry& geometry,
                const Lights& lights,
                const Instancers& instancers,
                const TfTokenVector& render_tags,
                LayerBuilder& builder)
        : geometry_(geometry),
          lights_(lights),
          instancers_(instancers),
          tags_(render_tags),
          builder_(builder) {
        for (const auto& [id, record] : geometry_)
            if (is_shown(record) && !record.instancer.IsEmpty())
                group(record.instancer, record.instance_indices).geometry.push_back(id);
        for (const auto& [id, record] : instancers_)
            if (!record.parent.IsEmpty())
                group(record.parent, record.instance_indices).instancers.push_back(id);
    }

    LayerPlaces author() {
        for (const auto& [id, record] : geometry_)
            if (record.instancer.IsEmpty() && is_shown(record))
                author_geometry(record, to_path(id), true);
        for (const auto& [id, record] : instancers_)
            if (record.parent.IsEmpty()) author_instancer(id, record, to_path(id), true);
        for (const auto& [id, record] : lights_) author_light(id, record);
        for (const auto& [path, record] : mesh_lights_) {
            AuthoredPrim prim("Mesh");
            set_links(prim, record->links);
            prim.author(builder_, path);
        }
        return std::move(places_);
    }

  private:
    bool is_shown(const GeometryRecord& record) const {
        return record.is_visible && (tags_.empty() || std::find(tags_.begin(), tags_.end(),
                                                                record.render_tag) != tags_.end());
    }

    PrototypeGroup& group(const SdfPath& instancer, const VtIntArray& indices) {
        std::vector<PrototypeGroup>& groups = groups_[instancer];
        const auto known = std::find_if(groups.begin(), groups.end(), [&](const PrototypeGroup& g) {
            return g.indices == indices;
        });
        if (known != groups.end()) return *known;
        groups.push_back({indices, {}, {}});
        return groups.back();
    }

    void author_geometry(const GeometryRecord& record, Path path, bool resets) {
        AuthoredPrim prim = record.prim;
        prim.set_transform(record.transform, resets);
        prim.author(builder_, path);
        places_.prim_ids[path.to_string()] = record.prim_id;
        for (const TfToken& category : record.categories) add_member(category, path);
        // What they light is known when all geometry is
        if (!record.links.light.IsEmpty() || !record.links.shadow.IsEmpty())
            mesh_lights_.emplace_back(path, &record);
    }

    void author_instancer(const SdfPath& id,
                          const InstancerRecord& record,
                          Path path,
                          bool resets) {
        const auto groups = groups_.find(id);
        if (groups == groups_.end()) return;
        const Path prototypes = path.append_child("Prototypes");
        AuthoredPrim prim(record.matrices.empty() ? "PointInstancer" : "Xform");
        prim.set_transform(record.transform, resets);
        if (record.matrices.empty()) set_points(prim, record, groups->second, prototypes);
        prim.author(builder_, path);
        if (!record.matrices.empty()) (void)builder_.define(prototypes, "Xform", Specifier::Class);
        for (size_t g = 0; g < groups->second.size(); ++g)
            author_group(groups->second[g], prototype_path(prototypes, g));
        if (!record.matrices.empty()) place_by_matrices(record, groups->second, path, prototypes);
        for (const VtTokenArray& categories : record.categories)
            if (record.matrices.empty())
                for (const TfToken& category : categories) add_member(category, path);
    }

    static Path prototype_path(Path prototypes, size_t group) {
        return prototypes.append_child("Prototype_" + std::to_string(group));
    }

    void author_group(const PrototypeGroup& group, Path root) {
        (void)builder_.define(root, "Xform");
        for (const SdfPath& id : group.geometry)
            author_geometry(geometry_.at(id), below(root, id), false);
        for (const SdfPath& id : group.instancers)
            author_instancer(id, instancers_.at(id), below(root, id), false);
    }

    /// The whole path as one name: prototypes of one instancer come from anywhere.
    static Path below(Path root, const SdfPath& id) {
        std::string name = "/" + id.GetString().substr(1);
        std::replace(name.begin() + 1, name.end(), '/', '_');
        std::replace(name.begin() + 1, name.end(), '.', '_');
        return root.append_child(to_path(SdfPath(name)).name());
    }

    /// (instance, group), in the order of the instances.
    static std::vector<std::pair<int, size_t>> placements(
        const std::vector<PrototypeGroup>& groups) {
        std::vector<std::pair<int, size_t>> all;
        for (size_t g = 0; g < groups.size(); ++g)
            for (const int index : groups[g].indices) all.emplace_back(index, g);
        std::sort(all.begin(), all.end());
        return all;
    }

    template <class To, class From>
    static Value picked(const VtArray<From>& from,
                        const std::vector<std::pair<int, size_t>>& placed,
                        const From& otherwise) {
        const VtValue chosen = [&] {
            VtArray<From> out;
            for (const auto& [index, g] : placed)
                out.push_back(size_t(index) < from.size() ? from[size_t(index)] : otherwise);
            return VtValue(out);
        }();
        return to_value(chosen)->value;
    }

    void set_points(AuthoredPrim& prim,
                    const InstancerRecord& record,
                    const std::vector<PrototypeGroup>& groups,
                    Path prototypes) const {
        const auto placed = placements(groups);
        std::vector<Path> targets;
        for (size_t g = 0; g < groups.size(); ++g) targets.push_back(prototype_path(prototypes, g));
        prim.target("prototypes", std::move(targets));
        std::vector<int32_t> prototype_of;
        for (const auto& [index, g] : placed) prototype_of.push_back(int32_t(g));
        prim.set("protoIndices", "int[]", Value::array(std::move(prototype_of)));
        prim.set("positions", "point3f[]",
                 picked<GfVec3f>(record.translations, placed, GfVec3f(0.0f)));
        if (!record.scales.empty())
            prim.set("scales", "float3[]", picked<GfVec3f>(record.scales, placed, GfVec3f(1.0f)));
        if (record.rotations.IsHolding<VtQuathArray>())
            prim.set("orientations", "quath[]",
                     picked<GfQuath>(record.rotations.UncheckedGet<VtQuathArray>(), placed,
                                     GfQuath::GetIdentity()));
        else if (record.rotations.IsHolding<VtQuatfArray>())
            prim.set("orientationsf", "quatf[]",
                     picked<GfQuatf>(record.rotations.UncheckedGet<VtQuatfArray>(), placed,
                                     GfQuatf::GetIdentity()));
        std::vector<int32_t> rows;
        for (const auto& [index, g] : placed) rows.push_back(index);
        for (const auto& [name, value] : record.primvars)
            prim.set_interpolated("primvars:" + name, value, "vertex", rows);
    }

    /// A prim for each instance, which inherits the prototype.
    void place_by_matrices(const InstancerRecord& record,
                           const std::vector<PrototypeGroup>& groups,
                           Path path,
                           Path prototypes) {
        size_t number = 0;
        for (const auto& [index, g] : placements(groups)) {
            if (size_t(index) >= record.matrices.size()) continue;
            char name[24];
            std::snprintf(name, sizeof name, "Instance_%08zu", number++);
            const Path place = path.append_child(name);
            AuthoredPrim prim("Xform");
            prim.set_transform(record.matrices[size_t(index)], false);
            prim.add_metadata("", "instanceable", Value(true));
            prim.add_metadata(
                "", "inheritPaths",
                Value(usd::layer::PathListOp::make_explicit({prototype_path(prototypes, g)})));
            prim.author(builder_, place);
            for (const SdfPath& id : groups[g].geometry)
                places_.prim_ids[below(place, id).to_string()] = geometry_.at(id).prim_id;
            if (size_t(index) < record.categories.size())
                for (const TfToken& category : record.categories[size_t(index)])
                    add_member(category, place);
        }
    }

    void add_member(const TfToken& category, Path path) {
        std::vector<Path>& members = members_[category];
        if (members.empty() || members.back() != path) members.push_back(path);
    }

    void author_light(const SdfPath& id, const LightRecord& record) {
        AuthoredPrim prim = record.prim;
        set_links(prim, record.links);
        prim.author(builder_, to_path(id));
    }

    void set_links(AuthoredPrim& prim, const LightLinkNames& links) const {
        set_link(prim, "lightLink", links.light);
        set_link(prim, "shadowLink", links.shadow);
    }

    /// The collection of what Hydra says to be in the category.
    void set_link(AuthoredPrim& prim, const std::string& link, const TfToken& category) const {
        if (category.IsEmpty()) return;
        prim.apply_schema("CollectionAPI:" + link);
        prim.set("collection:" + link + ":includeRoot", "bool", Value(false));
        prim.set_token("collection:" + link + ":expansionRule", "expandPrims");
        const auto members = members_.find(category);
        prim.target("collection:" + link + ":includes",
                    members == members_.end() ? std::vector<Path>() : members->second);
    }

    const Geometry& geometry_;
    const Lights& lights_;
    const Instancers& instancers_;
    const TfTokenVector& tags_;
    LayerBuilder& builder_;
    std::map<SdfPath, std::vector<PrototypeGroup>> groups_;
    std::map<TfToken, std::vector<Path>> members_;
    std::vector<std::pair<Path, const GeometryRecord*>> mesh_lights_;  ///< with links
    LayerPlaces places_;
};

}  // namespace

void SceneRecords::set_geometry(const SdfPath& id, GeometryRecord record) {
    const std::lock_guard lock(mutex_);
    geometry_.insert_or_assign(id, std::move(record));
    ++version_;
}

void SceneRecords::set_light(const SdfPath& id, LightRecord record) {
    const std::lock_guard lock(mutex_);
    lights_.insert_or_assign(id, std::move(record));
    ++version_;
}

void SceneRecords::set_instancer(const SdfPath& id, InstancerRecord record) {
    const std::lock_guard lock(mutex_);
    instancers_.insert_or_assign(id, std::move(record));
    ++version_;
}

void SceneRecords::set_other(const SdfPath& id, AuthoredPrim prim) {
    const std::lock_guard lock(mutex_);
    others_.insert_or_assign(id, std::move(prim));
    ++version_;
}

void SceneRecords::remove(const SdfPath& id) {
    const std::lock_guard lock(mutex_);
    geometry_.erase(id);
    lights_.erase(id);
    instancers_.erase(id);
    others_.erase(id);
    ++version_;
}

int SceneRecords::version() const {
    const std::lock_guard lock(mutex_);
    return version_;
}

LayerPlaces SceneRecords::author(LayerBuilder& builder, const TfTokenVector& render_tags) const {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, prim] : others_) prim.author(builder, to_path(id));
    return LayerAuthor(geometry_, lights_, instancers_, render_tags, builder).author();
}

}  // namespace velatura::hydra
