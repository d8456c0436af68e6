// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lights/light_selector.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace velatura::lights {

/// For scenes in which some light shines on some geometry only: a selector for each part of the
/// geometry that the same lights shine on, so that no choice is lost on one that does not. Parts
/// for which there is no room choose among all lights; what was chosen must be asked for
/// LightSet::illuminates() in any case.
class LinkedSelector final : public LightSelector {
  public:
    /// A selector among some items; null = among all.
    using Make = std::function<std::unique_ptr<LightSelector>(const std::vector<bool>*)>;

    /// Lights and emissive triangles that all selectors together hold, about.
    static constexpr size_t max_places = size_t(1) << 22;

    LinkedSelector(const LightSet& lights, const Make& make, size_t room = max_places);

    bool is_empty() const override;
    bool is_single() const override;

    std::optional<LightChoice> select(const Receiver& at, double u) const override {
        return of(at).select(at, u);
    }

    float pmf(const Receiver& at, LightId light) const override { return of(at).pmf(at, light); }

    size_t selector_count() const { return selectors_.size(); }

  private:
    const LightSelector& of(const Receiver& at) const { return *selectors_[of_class_[at.link]]; }

    std::vector<std::unique_ptr<LightSelector>> selectors_;  // the first one among all
    std::vector<uint32_t> of_class_;
};

}  // namespace velatura::lights
