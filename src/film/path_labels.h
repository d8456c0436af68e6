// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/path_automaton.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace velatura::film {

/// What a path did so far, as its layers tell paths apart: parts of its light by what each
/// scattering may have been, never by which lobe the sampler drew. Cleared and used again.
class PathLabels {
  public:
    explicit PathLabels(PathAutomaton automaton)
        : automaton_(std::move(automaton)), place_of_(automaton_.state_count()) {
        begin();
    }

    /// A path leaves the camera.
    void begin();

    /// Light is looked for beyond one more scattering: what is given by it from here on.
    void look(const EventShares& scattering);
    /// And one more.
    void look_on(const EventShares& scattering);
    /// The path takes the direction that was looked along last.
    void go();
    /// What comes next is not looked for: it is met by the path as it went.
    void stay();
    /// The path meets light that counts by these multipliers, which go with what its last
    /// scattering was; until stay().
    void weigh(float diffuse, float specular);

    /// State of the automaton, and the part of the light that belongs to it. States of no layer are
    /// left out.
    using Part = std::pair<PathAutomaton::State, accumulate::Triple>;
    using Parts = std::vector<Part>;

    /// Of the light that is given now.
    const Parts& parts() const { return given_; }

    const PathAutomaton& automaton() const { return automaton_; }

    /// The path as it went, for what divides.
    struct PathPrefix {
        Parts path, before;
        EventShares last;
    };

    PathPrefix prefix() const { return {path_, before_, last_}; }

    void restore(const PathPrefix& prefix);

  private:
    void step(const Parts& from, const EventShares& scattering, Parts& to);

    PathAutomaton automaton_;
    Parts path_;    ///< after the last scattering
    Parts before_;  ///< and before it
    Parts given_;   ///< path_, or a scattering further
    Parts room_;
    EventShares last_, looked_;
    std::vector<uint16_t>
        place_of_;  ///< per state: where it stands in what step() makes, + 1; 0 between calls
};

}  // namespace velatura::film
