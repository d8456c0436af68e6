// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/history.h"

#include "compositor/look/look_rows.h"

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
    const bool continues = !gesture.empty() && gesture == gesture_;
    if (!continues) {
        past_.push_back(now_);
        if (past_.size() > longest_past) past_.erase(past_.begin());
    }
    now_ = std::move(next);
    future_.clear();
    gesture_ = gesture;
    // A drag that came back to where it began was none
    if (continues && same(now_, past_.back())) {
        past_.pop_back();
        gesture_.clear();
    }
}

bool History::undo() {
    return step(past_, future_);
}

bool History::redo() {
    return step(future_, past_);
}

bool History::step(std::vector<Looks>& from, std::vector<Looks>& to) {
    if (from.empty()) return false;
    to.push_back(std::exchange(now_, std::move(from.back())));
    from.pop_back();
    seal();
    return true;
}

void History::reset(Looks looks) {
    *this = History();
    now_ = std::move(looks);
}

}  // namespace velatura::compositor::window
