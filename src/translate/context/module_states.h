// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

namespace velatura::translate {
inline namespace context {

/// State of the modules while a stage is translated: one value of each requested type. A type
/// belongs to the module that declares it, so that this module includes none of them.
class ModuleStates {
  public:
    /// The state, made on first use; the reference stays valid.
    template <class State>
    State& of() {
        if (void* known = find(&key_of<State>)) return *static_cast<State*>(known);
        slots_.push_back({&key_of<State>, std::make_shared<State>()});
        return *static_cast<State*>(slots_.back().state.get());
    }

    /// The state for reading; a default one before the first use.
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
