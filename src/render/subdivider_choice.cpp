// SPDX-License-Identifier: Apache-2.0
#include "render/subdivider_choice.h"

#include "geometry/refinement.h"
#include "plugin/registry.h"

#include <fmt/format.h>

namespace velatura::render {

namespace {

const plugin::Need subdivider_need = {geometry::subdivider_interface,
                                      geometry::subdivider_interface_version,
                                      {"effect", "subdivision"},
                                      "subdivision"};

}  // namespace

const geometry::Subdivider* find_subdivider(const scene::Scene& scene, Diagnostics& diagnostics) {
    const scene::Shape* first = geometry::first_subdivided(scene);
    if (first == nullptr) return nullptr;
    const Result<const void*> object = plugin::open_needed(subdivider_need);
    if (object) return static_cast<const geometry::Subdivider*>(*object);
    const scene::Provenance where = first->provenance < scene.provenance.size()
                                        ? scene.provenance[first->provenance]
                                        : scene::Provenance();
    diagnostics.warn(
        "subdivision", where.loc, where.prim_path,
        fmt::format("{}: subdivision meshes are rendered unsubdivided (the first is named here)",
                    object.error().message));
    return nullptr;
}

}  // namespace velatura::render
