// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

namespace velatura::translate {
inline namespace context {

/// What the rooms keep while a stage is translated: one value of each type that is asked for. A
/// type belongs to the room that declares it, so that this room need not know any.
class RoomStates {
  public:
    /// The state, made on first use. It stays where it is.
    template <class State>
    State& of() {
        if (void* known = find(&key_of<State>)) return *static_cast<State*>(known);
        slots_.push_back({&key_of<State>, std::make_shared<State>()});
        return *static_cast<State*>(slots_.back().state.get());
    }

    /// The same for reading; one that nobody has changed where there is none.
    template <class State>
    const State& of() const {
        static const State untouched{};
        const void* known = find(&key_of<State>);
        return known ? *static_cast<const State*>(known) : untouched;
    }

  private:
    struct Slot {
        const void* key;
        std::shared_ptr<void> state;
    };

    template <class State>
    static constexpr char key_of = 0;

    void* find(const void* key) const {
        const auto slot =
            std::find_if(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.key == key; });
        return slot == slots_.end() ? nullptr : slot->state.get();
    }

    std::vector<Slot> slots_;  ///< a dozen
};

}  // namespace context
}  // namespace velatura::translate
