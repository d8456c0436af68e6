// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/look/controls.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// The two looks that the wipe compares: A and B.
using Looks = std::array<Look, 2>;

/// What was changed, and back again.
class History {
  public:
    const Looks& now() const { return now_; }

    /// A gesture (a drag of one slider) is one step, however many values it passes through: changes
    /// of the same name are one until seal() ends it.
    void change(Looks next, const std::string& gesture);

    void seal() { gesture_.clear(); }

    /// False when there is nothing to go to.
    bool undo();
    bool redo();

    bool can_undo() const { return !past_.empty(); }

    bool can_redo() const { return !future_.empty(); }

    /// Begins anew with those looks.
    void reset(Looks looks);

  private:
    bool step(std::vector<Looks>& from, std::vector<Looks>& to);

    Looks now_;
    std::vector<Looks> past_, future_;
    std::string gesture_;  ///< that is going on; empty: none
};

}  // namespace velatura::compositor::window
