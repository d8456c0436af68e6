// SPDX-License-Identifier: Apache-2.0
#include "film/light_path_expression.h"
#include "film/path_automaton.h"
#include "fuzz_targets.h"

#include <cstdlib>
#include <string>
#include <vector>

namespace velatura::fuzz {

/// Any two lines are light path expressions or refused; the automaton of what is read knows a
/// state, or none, after any event.
void lpe(std::string_view bytes) {
    const size_t line = bytes.find('\n');
    const std::string_view first = bytes.substr(0, line),
                           second = line == std::string_view::npos ? "" : bytes.substr(line + 1);
    std::vector<accumulate::PathLayer> layers = {film::make_path_layer("a", first, "paths")};
    if (!second.empty()) layers.push_back(film::make_path_layer("b", second, "paths"));
    const std::vector<accumulate::LightGroup> groups = {
        {"key", {"/key"}, false}, {"sky", {"/sky"}, true}, {"shapes", {}, false}};
    for (const bool is_strict : {false, true}) {
        const auto automaton = film::PathAutomaton::make(layers, is_strict, groups);
        if (!automaton) continue;
        if (automaton->state_count() > film::PathAutomaton::max_states) std::abort();
        for (size_t state = 0; state < automaton->state_count(); ++state) {
            for (size_t event = 0; event < film::path_event_count; ++event) {
                const auto next =
                    automaton->next(film::PathAutomaton::State(state), film::PathEvent(event));
                if (next != film::PathAutomaton::dead && next >= automaton->state_count())
                    std::abort();
            }
            for (int group = 0; group < int(groups.size()); ++group)
                for (const uint16_t layer :
                     automaton->layers_of(film::PathAutomaton::State(state), group))
                    if (layer >= layers.size()) std::abort();
        }
    }
}

}  // namespace velatura::fuzz
