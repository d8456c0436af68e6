// SPDX-License-Identifier: Apache-2.0
#include "film/path_labels.h"

namespace velatura::film {

namespace {

accumulate::Triple product(const accumulate::Triple& a, const accumulate::Triple& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

/// Shares of what counts by multipliers.
EventShares weighed(const EventShares& shares, float diffuse, float specular) {
    EventShares out;
    accumulate::Triple sum;
    for (const auto& [event, share] : shares) {
        const double by = double(is_diffuse(event) ? diffuse : specular);
        out.add(event, {share.x * by, share.y * by, share.z * by});
        sum += out.shares[out.count - 1].share;
    }
    for (size_t i = 0; i < out.count; ++i) {
        accumulate::Triple& share = out.shares[i].share;
        const accumulate::Triple& same = shares.shares[i].share;
        // Where nothing counts there is nothing to share
        share = {sum.x > 0 ? share.x / sum.x : same.x, sum.y > 0 ? share.y / sum.y : same.y,
                 sum.z > 0 ? share.z / sum.z : same.z};
    }
    return out;
}

}  // namespace

void PathLabels::begin() {
    path_.clear();
    if (automaton_.start() != PathAutomaton::dead)
        path_.push_back({automaton_.start(), {1.0, 1.0, 1.0}});
    before_ = given_ = path_;
    last_ = looked_ = {};
}

void PathLabels::step(const Parts& from, const EventShares& scattering, Parts& to) {
    to.clear();
    for (const auto& [state, part] : from) {
        for (const auto& [event, share] : scattering) {
            const PathAutomaton::State next = automaton_.next(state, event);
            const accumulate::Triple value = product(part, share);
            if (next == PathAutomaton::dead || value.is_zero()) continue;
            uint16_t& place = place_of_[next];
            if (place == 0) {
                to.push_back({next, value});
                place = uint16_t(to.size());
            } else {
                to[place - 1].second += value;
            }
        }
    }
    for (const Part& part : to) place_of_[part.first] = 0;
}

void PathLabels::look(const EventShares& scattering) {
    looked_ = scattering;
    step(path_, scattering, given_);
}

void PathLabels::look_on(const EventShares& scattering) {
    step(given_, scattering, room_);
    std::swap(given_, room_);
}

void PathLabels::go() {
    std::swap(before_, path_);
    path_ = given_;
    last_ = looked_;
}

void PathLabels::stay() {
    given_ = path_;
}

void PathLabels::weigh(float diffuse, float specular) {
    step(before_, weighed(last_, diffuse, specular), given_);
}

void PathLabels::restore(const PathPrefix& prefix) {
    path_ = given_ = prefix.path;
    before_ = prefix.before;
    last_ = prefix.last;
}

}  // namespace velatura::film
