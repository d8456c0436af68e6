// SPDX-License-Identifier: Apache-2.0
#include "translate/linking/link_subsets.h"

#include "translate/geometry/mesh.h"
#include "translate/geometry/mesh_faces.h"
#include "translate/linking/linking.h"

#include <algorithm>
#include <map>
#include <set>

namespace velatura::translate::linking {

namespace {

using usd::layer::Path;
using usd::stage::CollectionQuery;

class Divider {
  public:
    Divider(Context& ctx, const std::vector<CollectionQuery>& queries)
        : ctx_(ctx), queries_(queries) {
        for (const CollectionQuery& query : queries) {
            for (const Path& path : query.rule_paths()) {
                const Prim prim = ctx.stage.prim_at(path);
                if (prim && prim.type_name().str() == "GeomSubset")
                    named_.insert(path.name().str());
            }
        }
    }

    SubsetsOfPart run() {
        // Parts go to the end, where nothing is counted yet
        const size_t direct = ctx_.scene.shapes.size();
        for (size_t i = 0; i < direct; ++i) {
            const size_t before = ctx_.scene.shapes.size();
            divide(ctx_.scene.shapes, i);
            LinkPathMappings& places = ctx_.state<LinkPathMappings>();
            places.of_baked.insert(places.of_baked.end(), ctx_.scene.shapes.size() - before,
                                   places.of_shape(i));
        }
        for (scene::Prototype& prototype : ctx_.scene.prototypes) {
            const size_t count = prototype.shapes.size();
            for (size_t i = 0; i < count; ++i) divide(prototype.shapes, i);
        }
        return std::move(subsets_of_part_);
    }

  private:
    /// Whether some collection may tell the subset from its mesh, wherever it stands.
    bool is_told_apart(const Path& subset) const {
        if (named_.contains(subset.name().str())) return true;
        return std::any_of(queries_.begin(), queries_.end(), [&](const CollectionQuery& query) {
            return query.has_expression() && query.includes(subset) &&
                   !query.includes(subset.parent());
        });
    }

    void divide(std::vector<scene::Shape>& shapes, size_t index) {
        const auto& of_mesh = ctx_.state<geometry::FaceSubsets>().of_mesh;
        const auto found = of_mesh.find(shapes[index].provenance);
        if (found == of_mesh.end()) return;
        std::vector<const geometry::FaceSubset*> subsets;
        for (const geometry::FaceSubset& subset : found->second)
            if (is_told_apart(subset.path)) subsets.push_back(&subset);
        if (subsets.empty()) return;
        if (shapes[index].light != scene::none) {
            const Path mesh = subsets.front()->path.parent();
            ctx_.warn("unsupported-light-linking", ctx_.stage.prim_at(mesh),
                      "GeomSubsets of geometry that is a light are not linked on their own");
            return;
        }

        // Faces that the same subsets hold make a part
        const auto mesh = std::get<scene::Mesh>(std::move(shapes[index].geometry));
        std::vector<std::vector<bool>> held(mesh.face_vertex_counts.size(),
                                            std::vector<bool>(subsets.size()));
        for (size_t s = 0; s < subsets.size(); ++s)
            for (const uint32_t face : subsets[s]->faces) held[face][s] = true;
        std::map<std::vector<bool>, std::vector<uint32_t>> parts;
        for (uint32_t face = 0; face < held.size(); ++face) parts[held[face]].push_back(face);
        const scene::Shape whole = shapes[index];
        for (const auto& [holders, faces] : parts) {
            scene::Shape part = whole;
            part.geometry = geometry::with_faces(mesh, faces);
            part.provenance = provenance_of_part(whole.provenance, subsets, holders);
            if (&faces == &parts.begin()->second)
                shapes[index] = std::move(part);
            else
                shapes.push_back(std::move(part));
        }
    }

    scene::ProvenanceId provenance_of_part(scene::ProvenanceId whole,
                                           const std::vector<const geometry::FaceSubset*>& subsets,
                                           const std::vector<bool>& holders) {
        const scene::Provenance copy = ctx_.scene.provenance[whole];
        const auto id = scene::ProvenanceId(ctx_.scene.provenance.size());
        ctx_.scene.provenance.push_back(copy);
        for (size_t s = 0; s < subsets.size(); ++s)
            if (holders[s]) subsets_of_part_[id].push_back(subsets[s]->path);
        return id;
    }

    Context& ctx_;
    const std::vector<CollectionQuery>& queries_;
    std::set<std::string> named_;  // names of subsets
    SubsetsOfPart subsets_of_part_;
};

}  // namespace

SubsetsOfPart divide_by_subsets(Context& ctx, const std::vector<CollectionQuery>& queries) {
    return Divider(ctx, queries).run();
}

}  // namespace velatura::translate::linking
