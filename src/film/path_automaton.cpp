// SPDX-License-Identifier: Apache-2.0
#include "film/path_automaton.h"

#include "accumulate/names.h"
#include "film/light_path_expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

namespace velatura::film {

namespace {

/// Nodes with edges that wait for a symbol or for nothing (Thompson 1968).
class Nodes {
  public:
    static constexpr size_t max = 1 << 13;
    static constexpr int none = -1;

    int add() {
        list_.emplace_back();
        return int(list_.size()) - 1;
    }

    void join(int from, int to) { list_[size_t(from)].free.push_back(to); }

    bool is_full() const { return list_.size() > max; }

    /// Adds what matches the pattern after `from`. Returns: where it ends.
    int append(const PathPattern& pattern, int from) {
        using Kind = PathPattern::Kind;
        if (is_full()) return from;
        switch (pattern.kind) {
            case Kind::Event: {
                const int to = add();
                list_[size_t(from)].event = &pattern.event;
                list_[size_t(from)].to = to;
                return to;
            }
            case Kind::Sequence: {
                int at = from;
                for (const PathPattern& part : pattern.parts) at = append(part, fresh(at));
                return at;
            }
            case Kind::Choice: {
                const int end = add();
                for (const PathPattern& part : pattern.parts) join(append(part, fresh(from)), end);
                return end;
            }
            case Kind::Repeat:
                return append_repeat(pattern, from);
        }
        return from;
    }

    struct Node {
        const SymbolSet* event = nullptr;
        int to = none;
        std::vector<int> free;
    };

    const Node& operator[](int i) const { return list_[size_t(i)]; }

  private:
    /// A node that nothing else leaves.
    int fresh(int from) {
        const int to = add();
        join(from, to);
        return to;
    }

    int append_repeat(const PathPattern& pattern, int from) {
        int at = fresh(from);
        for (int i = 0; i < pattern.min; ++i) at = append(pattern.parts[0], fresh(at));
        const int end = add();
        join(at, end);
        for (int i = pattern.min; i < pattern.max; ++i) {
            at = append(pattern.parts[0], fresh(at));
            join(at, end);
        }
        if (pattern.max < 0) join(append(pattern.parts[0], fresh(at)), at);
        return end;
    }

    std::vector<Node> list_;
};

Error about(const accumulate::PathLayer& layer, const std::string& why) {
    return {"lpe", fmt::format("light path expression \"{}\": {}", layer.expression, why)};
}

}  // namespace

/// The subsets of nodes that paths can be in.
class AutomatonBuilder {
  public:
    explicit AutomatonBuilder(size_t groups) { out_.class_of_.resize(groups); }

    Result<PathAutomaton> build(const std::vector<PathPattern>& patterns) {
        for (const PathPattern& pattern : patterns) {
            const int begin = nodes_.add();
            begins_.push_back(begin);
            ends_.push_back(nodes_.append(pattern, begin));
        }
        make_classes(patterns);
        if (nodes_.is_full()) return Error{"lpe", "light path expressions: too long"};
        Subset first = closure(begins_);
        first = step(first, PathSymbols::camera);
        const size_t start = number_of(first);
        size_t work = 0;
        for (size_t at = 0; at < subsets_.size(); ++at) {
            if (subsets_.size() > PathAutomaton::max_states)
                return Error{"lpe", fmt::format("light path expressions: together they need more "
                                                "than {} states; use fewer or simpler ones",
                                                PathAutomaton::max_states)};
            work += subsets_[at].size();
            if (work > max_work) return Error{"lpe", "light path expressions: too long"};
            expand(at);
        }
        drop_dead();
        out_.start_ = is_live_[start] ? PathAutomaton::State(start) : PathAutomaton::dead;
        return std::move(out_);
    }

  private:
    using Subset = std::vector<int>;
    static constexpr size_t max_work = 1 << 17;  ///< nodes of all subsets together

    using Memberships = std::vector<bool>;

    static void collect(const PathPattern& pattern, size_t symbol, Memberships& out) {
        if (pattern.kind == PathPattern::Kind::Event) out.push_back(pattern.event[symbol]);
        for (const PathPattern& part : pattern.parts) collect(part, symbol, out);
    }

    void make_classes(const std::vector<PathPattern>& patterns) {
        std::map<Memberships, uint32_t> known;
        for (size_t g = 0; g < out_.class_of_.size(); ++g) {
            Memberships memberships;
            for (const PathPattern& p : patterns) collect(p, PathSymbols::of_group(g), memberships);
            const auto [at, is_new] = known.try_emplace(memberships, uint32_t(known.size()));
            if (is_new) one_of_.push_back(g);
            out_.class_of_[g] = at->second;
        }
        out_.classes_ = known.size();
    }

    Subset closure(Subset open) const {
        Subset all;
        std::vector<bool> is_seen;
        while (!open.empty()) {
            const int at = open.back();
            open.pop_back();
            if (is_seen.size() <= size_t(at)) is_seen.resize(size_t(at) + 1, false);
            if (is_seen[size_t(at)]) continue;
            is_seen[size_t(at)] = true;
            all.push_back(at);
            open.insert(open.end(), nodes_[at].free.begin(), nodes_[at].free.end());
        }
        std::sort(all.begin(), all.end());
        return all;
    }

    Subset step(const Subset& from, size_t symbol) const {
        Subset to;
        for (const int at : from)
            if (nodes_[at].event && (*nodes_[at].event)[symbol]) to.push_back(nodes_[at].to);
        return closure(std::move(to));
    }

    size_t number_of(const Subset& subset) {
        const auto [at, is_new] = numbers_.try_emplace(subset, subsets_.size());
        if (is_new) subsets_.push_back(subset);
        return at->second;
    }

    void expand(size_t at) {
        const Subset subset = subsets_[at];
        auto& row = out_.next_.emplace_back();
        for (size_t e = 0; e < path_event_count; ++e) {
            const Subset to = step(subset, PathSymbols::of(PathEvent(e)));
            row[e] = to.empty() ? PathAutomaton::dead : PathAutomaton::State(number_of(to));
        }
        for (const size_t group : one_of_) {
            const Subset to = step(subset, PathSymbols::of_group(group));
            std::vector<uint16_t> layers;
            for (size_t i = 0; i < ends_.size(); ++i)
                if (std::binary_search(to.begin(), to.end(), ends_[i]))
                    layers.push_back(uint16_t(i));
            const auto [known, is_new] = lists_.try_emplace(layers, uint32_t(out_.lists_.size()));
            if (is_new) out_.lists_.push_back(layers);
            out_.accepted_.push_back(known->second);
        }
    }

    /// States from which no light is wanted are none.
    void drop_dead() {
        is_live_.assign(subsets_.size(), false);
        for (bool has_changed = true; has_changed;) {
            has_changed = false;
            for (size_t s = subsets_.size(); s-- > 0;) {
                if (is_live_[s] || !is_wanted(s)) continue;
                is_live_[s] = has_changed = true;
            }
        }
        for (auto& row : out_.next_)
            for (PathAutomaton::State& to : row)
                if (to != PathAutomaton::dead && !is_live_[to]) to = PathAutomaton::dead;
    }

    bool is_wanted(size_t s) const {
        for (const size_t group : one_of_)
            if (!out_.layers_of(PathAutomaton::State(s), int(group)).empty()) return true;
        const auto& row = out_.next_[s];
        return std::any_of(row.begin(), row.end(), [this](PathAutomaton::State to) {
            return to != PathAutomaton::dead && is_live_[to];
        });
    }

    PathAutomaton out_;
    Nodes nodes_;
    Subset begins_, ends_;
    std::vector<Subset> subsets_;
    std::map<Subset, size_t> numbers_;
    std::map<std::vector<uint16_t>, uint32_t> lists_;
    std::vector<bool> is_live_;
    std::vector<size_t> one_of_;  ///< per class, a group of it
};

namespace {

/// Whether light is wanted at the first scattering alone.
bool is_of_first_scattering(const PathAutomaton& automaton, size_t groups) {
    const auto is_lit = [&](PathAutomaton::State state) {
        for (size_t g = 0; g < groups; ++g)
            if (!automaton.layers_of(state, int(g)).empty()) return true;
        return false;
    };
    if (is_lit(automaton.start())) return false;
    for (size_t e = 0; e < path_event_count; ++e) {
        const PathAutomaton::State first = automaton.next(automaton.start(), PathEvent(e));
        if (first == PathAutomaton::dead) continue;
        for (size_t f = 0; f < path_event_count; ++f)
            if (automaton.next(first, PathEvent(f)) != PathAutomaton::dead) return false;
    }
    return true;
}

/// What is wrong with it that its grammar allows, in a scene with lights of all kinds.
std::optional<Error> fault_of(const accumulate::PathLayer& layer,
                              bool is_strict,
                              std::vector<accumulate::LightGroup> with_all) {
    with_all.push_back({"", {}, false});
    with_all.push_back({"", {}, true});
    with_all.push_back({accumulate::emissive_group, {}, false});
    const PathSymbols symbols(with_all);
    const size_t groups = with_all.size();
    const Result<PathPattern> pattern = parse_path_expression(layer.expression, symbols, is_strict);
    if (!pattern) return pattern.error();
    const Result<PathAutomaton> alone = AutomatonBuilder(groups).build({*pattern});
    if (!alone) return about(layer, alone.error().message);
    if (alone->start() == PathAutomaton::dead)
        return about(
            layer,
            "no path can match it; it must start with C and end with L, O, B or a light group");
    if (layer.light != accumulate::PathLayer::Light::Arriving &&
        !is_of_first_scattering(*alone, groups))
        return about(
            layer, "unoccluded light exists for direct light only; write C, one event and a light");
    return std::nullopt;
}

}  // namespace

Result<PathAutomaton> PathAutomaton::make(const std::vector<accumulate::PathLayer>& layers,
                                          bool is_strict,
                                          const std::vector<accumulate::LightGroup>& groups) {
    if (layers.size() > max_layers)
        return Error{"lpe",
                     fmt::format("{} layers of light path expressions exceed the maximum of {}",
                                 layers.size(), max_layers)};
    const PathSymbols symbols(groups);
    std::vector<PathPattern> patterns;
    for (const accumulate::PathLayer& layer : layers) {
        Result<PathPattern> pattern = parse_path_expression(layer.expression, symbols, is_strict);
        if (!pattern) return pattern.error();
        if (std::optional<Error> fault = fault_of(layer, is_strict, groups))
            return *std::move(fault);
        patterns.push_back(std::move(*pattern));
    }
    return AutomatonBuilder(groups.size()).build(patterns);
}

}  // namespace velatura::film
