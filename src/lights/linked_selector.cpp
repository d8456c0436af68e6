// SPDX-License-Identifier: Apache-2.0
#include "lights/linked_selector.h"

#include "lights/emissive_surfaces.h"

#include <algorithm>
#include <map>

namespace velatura::lights {

namespace {

/// What a selector among all items holds.
size_t place_count(const LightSet& lights) {
    size_t count = lights.item_count();
    const EmissiveSurfaces* surfaces = lights.surfaces();
    for (uint32_t group = 0; surfaces && group < surfaces->group_count(); ++group)
        count += surfaces->group_size(group);
    return count;
}

}  // namespace

LinkedSelector::LinkedSelector(const LightSet& lights, const Make& make, size_t room) {
    const size_t places = place_count(lights);
    std::map<std::vector<bool>, uint32_t> known;
    selectors_.push_back(make(nullptr));
    known[std::vector<bool>(lights.item_count(), true)] = 0;
    for (scene::LinkClass c = 0; c < lights.link_class_count(); ++c) {
        std::vector<bool> among(lights.item_count());
        for (uint32_t item = 0; item < lights.item_count(); ++item)
            among[item] = lights.item_illuminates(item, c);
        const auto [at, is_new] = known.try_emplace(among, uint32_t(selectors_.size()));
        if (is_new) {
            const bool has_room = (selectors_.size() + 1) * places <= room;
            if (has_room)
                selectors_.push_back(make(&among));
            else
                at->second = 0;
        }
        of_class_.push_back(at->second);
    }
}

bool LinkedSelector::is_empty() const {
    return std::all_of(selectors_.begin(), selectors_.end(),
                       [](const auto& selector) { return selector->is_empty(); });
}

bool LinkedSelector::is_single() const {
    return std::all_of(selectors_.begin(), selectors_.end(), [](const auto& selector) {
        return selector->is_single() || selector->is_empty();
    });
}

}  // namespace velatura::lights
