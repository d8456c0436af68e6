// SPDX-License-Identifier: Apache-2.0
#include "scene/scene.h"

#include <algorithm>

namespace velatura::scene {

PrimvarId find_primvar(const Scene& scene, std::string_view name) {
    const auto it = std::find(scene.primvar_names.begin(), scene.primvar_names.end(), name);
    return it == scene.primvar_names.end() ? none : PrimvarId(it - scene.primvar_names.begin());
}

PrimvarId intern_primvar(Scene& scene, std::string_view name) {
    const PrimvarId found = find_primvar(scene, name);
    if (found != none) return found;
    scene.primvar_names.emplace_back(name);
    return PrimvarId(scene.primvar_names.size() - 1);
}

}  // namespace velatura::scene
