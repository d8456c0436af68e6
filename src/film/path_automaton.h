// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_set.h"
#include "base/result.h"
#include "film/path_event.h"

#include <array>
#include <cstdint>
#include <vector>

namespace velatura::film {

/// What the events of a path so far mean to all path layers together: a deterministic automaton
/// made of their expressions. Ref: Rabin & Scott 1959; Heckbert 1990 for expressions of light
/// paths.
class PathAutomaton {
  public:
    using State = uint16_t;
    /// No layer can want the path any more.
    static constexpr State dead = 0xffff;
    /// A path may be in all of them, each with a part of its light.
    static constexpr size_t max_states = 512;
    static constexpr size_t max_layers = 4096;

    /// Errors: "lpe" (what parse_path_expression() says; too many states; unoccluded light after
    /// more than one scattering; an expression that no path can match), naming the expression.
    static Result<PathAutomaton> make(const std::vector<accumulate::PathLayer>& layers,
                                      bool is_strict,
                                      const std::vector<accumulate::LightGroup>& groups);

    /// Of a path that left the camera.
    State start() const { return start_; }

    State next(State state, PathEvent event) const { return next_[state][size_t(event)]; }

    /// Indices of the layers that want the light of the group that a path in this state found.
    const std::vector<uint16_t>& layers_of(State state, int group) const {
        return lists_[accepted_[size_t(state) * classes_ + class_of_[size_t(group)]]];
    }

    size_t state_count() const { return next_.size(); }

  private:
    friend class AutomatonBuilder;

    State start_ = dead;
    size_t classes_ = 0;
    std::vector<uint32_t> class_of_;  ///< per group: those that no expression tells apart are one
    std::vector<std::array<State, path_event_count>> next_;
    std::vector<uint32_t> accepted_;            ///< state × class: index into lists_
    std::vector<std::vector<uint16_t>> lists_;  ///< each set of layers once
};

}  // namespace velatura::film
