// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/history.h"

#include "compositor/window/look_rows.h"

#include <utility>

namespace velatura::compositor::window {

namespace {

constexpr size_t longest_past = 1000;

bool same(const Looks& a, const Looks& b) {
    return same_look(a[0], b[0]) && same_look(a[1], b[1]);
}

}  // namespace

void History::change(Looks next, const std::string& gesture) {
    if (same(next, now_)) return;
    const bool goes_on = !gesture.empty() && gesture == gesture_;
    if (!goes_on) {
        past_.push_back(now_);
        if (past_.size() > longest_past) past_.erase(past_.begin());
    }
    now_ = std::move(next);
    future_.clear();
    gesture_ = gesture;
    // A drag that came back to where it began was none
    if (goes_on && same(now_, past_.back())) {
        past_.pop_back();
        gesture_.clear();
    }
}

bool History::undo() {
    if (past_.empty()) return false;
    future_.push_back(std::exchange(now_, std::move(past_.back())));
    past_.pop_back();
    seal();
    return true;
}

bool History::redo() {
    if (future_.empty()) return false;
    past_.push_back(std::exchange(now_, std::move(future_.back())));
    future_.pop_back();
    seal();
    return true;
}

void History::reset(Looks looks) {
    *this = History();
    now_ = std::move(looks);
}

}  // namespace velatura::compositor::window
