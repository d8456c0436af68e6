// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/fields.h"
#include "usd/stage/clips.h"
#include "usd/stage/prim_data.h"
#include "usd/stage/value_cast.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace velatura::usd::stage {

using layer::Dictionary;
using layer::Path;
using layer::Value;
using layer::Vec2d;

namespace {

/// Files one template may name.
constexpr size_t max_template_clips = 100000;

/// A clip set while the dictionaries of the layers are put together.
struct Draft {
    Dictionary info;
    const compose::LayerStack* stack = nullptr;
    const compose::StackLayer* anchor = nullptr;
    Path source_path;
    layer::LayerOffset to_stage;  ///< of the anchor
    int node_rank = 0;            ///< of the anchor's site
    size_t order = 0;             ///< in the anchor site's list of sets
    SourceLoc loc;
};

using Drafts = std::map<std::string, Draft>;

void retime_pairs(Dictionary& info, const char* key, const layer::LayerOffset& to_stage) {
    const auto entry = info.entries.find(key);
    if (entry == info.entries.end() || to_stage.is_identity()) return;
    const auto pairs = entry->second.as_array<Vec2d>();
    if (pairs.empty()) return;
    std::vector<Vec2d> moved(pairs.begin(), pairs.end());
    for (Vec2d& pair : moved) pair.x = to_stage.apply(pair.x);
    entry->second = Value::array(std::move(moved));
}

bool names_assets(const Dictionary& info) {
    return info.find("assetPaths") || info.find("templateAssetPath");
}

/// Reads the clips of one site, weakest layer first, so that stronger entries come on top.
class SiteReader {
  public:
    SiteReader(const PrimData& prim, const compose::Node& node, int rank, Diagnostics& diagnostics)
        : prim_(prim), node_(node), rank_(rank), diagnostics_(diagnostics) {}

    Drafts read() {
        const auto& layers = node_.stack->layers();
        for (auto it = layers.rbegin(); it != layers.rend(); ++it) {
            const layer::Spec* spec = it->layer->spec(node_.path);
            if (!spec) continue;
            if (const auto* clips = spec->field_as<Dictionary>(layer::fields().clips))
                read_layer(*it, *spec, *clips);
            const auto* sets = spec->field_as<layer::StringListOp>(layer::fields().clip_sets);
            if (sets) sets->apply_to(order_);
        }
        Drafts kept;
        for (size_t i = 0; i < order_.size(); ++i) {
            const auto draft = drafts_.find(order_[i]);
            if (draft == drafts_.end()) continue;
            draft->second.order = i;
            kept.insert(*draft);
        }
        return kept;
    }

  private:
    void read_layer(const compose::StackLayer& layer,
                    const layer::Spec& spec,
                    const Dictionary& clips) {
        const SourceLoc loc = spec.field_loc(layer::fields().clips);
        const layer::LayerOffset to_stage = offset_to_stage(node_, layer);
        for (const auto& entry : clips.entries) {
            const Dictionary* own = entry.second.get_if<Dictionary>();
            if (!own || entry.first.empty()) {
                diagnostics_.warn(
                    "usd-bad-clips", loc, prim_.path.to_string(),
                    fmt::format("clip set \"{}\" is not a named dictionary; it is ignored",
                                entry.first));
                continue;
            }
            Draft& draft = drafts_[entry.first];
            if (names_assets(*own)) {
                draft.stack = node_.stack;
                draft.anchor = &layer;
                draft.source_path = node_.path;
                draft.to_stage = to_stage;
                draft.node_rank = rank_;
            }
            draft.loc = loc;
            Dictionary info = *own;
            retime_pairs(info, "active", to_stage);
            retime_pairs(info, "times", to_stage);
            draft.info = info.merged_over(draft.info);
            // A set needs no mention in clipSets; the dictionary is sorted by name
            if (std::find(order_.begin(), order_.end(), entry.first) == order_.end())
                order_.push_back(entry.first);
        }
    }

    const PrimData& prim_;
    const compose::Node& node_;
    int rank_;
    Diagnostics& diagnostics_;
    Drafts drafts_;
    std::vector<std::string> order_;
};

/// "path/name.###.usd" in its parts; hashes of 0 in `fraction` where there is one group.
struct Template {
    std::string before;
    size_t whole = 0;
    size_t fraction = 0;
    std::string after;
};

bool read_template(const std::string& text, Template& out) {
    const size_t slash = text.find_last_of('/');
    const size_t from = slash == std::string::npos ? 0 : slash + 1;
    // Groups are whole parts between dots of the file's name
    std::vector<std::pair<size_t, size_t>> groups;
    for (size_t at = from; at < text.size();) {
        const size_t end = std::min(text.find('.', at), text.size());
        const std::string_view part = std::string_view(text).substr(at, end - at);
        if (!part.empty() && part.find_first_not_of('#') == std::string_view::npos)
            groups.emplace_back(at, end);
        at = end + 1;
    }
    if (groups.empty() || groups.size() > 2) return false;
    if (groups.size() == 2 && groups[1].first != groups[0].second + 1) return false;
    out.before = text.substr(0, groups[0].first);
    out.whole = groups[0].second - groups[0].first;
    if (groups.size() == 2) out.fraction = groups[1].second - groups[1].first;
    out.after = text.substr(groups.back().second);
    return true;
}

std::string template_file(const Template& t, double time) {
    // Digits beyond what int64 holds mean nothing in a file name
    const double whole = std::clamp(std::trunc(time), -9e15, 9e15);
    std::string digits = fmt::format("{:0{}d}", int64_t(whole), t.whole);
    if (t.fraction > 0) {
        const std::string decimal = fmt::format("{:.{}f}", time, t.fraction);
        digits += decimal.substr(decimal.find('.'));
    }
    return t.before + digits + t.after;
}

/// Turns drafts into checked definitions.
class DefinitionBuilder {
  public:
    DefinitionBuilder(const PrimData& prim,
                      const compose::LayerRegistry& registry,
                      Diagnostics& diagnostics)
        : prim_(prim), registry_(registry), diagnostics_(diagnostics) {}

    bool build(const std::string& name, const Draft& draft, ClipDefinition& out) {
        draft_ = &draft;
        name_ = name;
        out.name = name;
        out.stack = draft.stack;
        out.anchor = draft.anchor;
        out.source_path = draft.source_path;
        const auto prim_path = value<std::string>("primPath");
        if (!prim_path) return false;
        out.clip_path = Path::from(*prim_path);
        if (!out.clip_path.is_prim() || !out.clip_path.is_absolute())
            return bad(
                fmt::format("primPath is \"{}\", expected an absolute prim path", *prim_path));
        out.manifest = value<std::string>("manifestAssetPath").value_or("");
        out.interpolate_missing = value<bool>("interpolateMissingClipValues").value_or(false);
        std::vector<std::string> assets;
        std::vector<Vec2d> active, times;
        if (draft.info.find("assetPaths")) {
            assets =
                value<std::vector<std::string>>("assetPaths").value_or(std::vector<std::string>());
            const auto authored = value<std::vector<Vec2d>>("active");
            if (!authored) return false;
            active = *authored;
            times = value<std::vector<Vec2d>>("times").value_or(std::vector<Vec2d>());
        } else if (!expand_template(assets, active, times)) {
            return false;
        }
        return read_active(assets, active, out) && read_times(times, out);
    }

  private:
    bool bad(std::string message) {
        diagnostics_.warn("usd-bad-clips", draft_->loc, prim_.path.to_string(),
                          fmt::format("clip set \"{}\" is ignored: {}", name_, message));
        return false;
    }

    template <class T>
    std::optional<T> value(const char* key) const {
        const Value* found = draft_->info.find(key);
        return found ? value_cast<T>(*found) : std::nullopt;
    }

    bool expand_template(std::vector<std::string>& assets,
                         std::vector<Vec2d>& active,
                         std::vector<Vec2d>& times) {
        const auto text = value<std::string>("templateAssetPath");
        const auto first = value<double>("templateStartTime");
        const auto last = value<double>("templateEndTime");
        const auto stride = value<double>("templateStride");
        if (!text || !first || !last || !stride) return false;
        const auto offset = value<double>("templateActiveOffset");
        Template parts;
        if (!read_template(*text, parts)) {
            return bad(
                fmt::format("templateAssetPath is \"{}\", expected path/name.###.usd or "
                            "path/name.###.###.usd",
                            *text));
        }
        if (!(*stride > 0.0)) return bad("templateStride must be greater than 0");
        if (!(*first <= *last)) return bad("templateStartTime lies after templateEndTime");
        if (offset && std::abs(*offset) > *stride)
            return bad("templateActiveOffset exceeds templateStride");
        if (!((*last - *first) / *stride < double(max_template_clips)))
            return bad(fmt::format("more than {} files", max_template_clips));
        if (offset) add_knot(*first - std::abs(*offset), times);
        const auto count = size_t(std::floor((*last - *first) / *stride + 1e-9)) + 1;
        for (size_t i = 0; i < count; ++i) {
            const double time = *first + double(i) * *stride;
            const std::string asset = template_file(parts, time);
            const std::string file = registry_.resolve(asset, draft_->anchor->layer->identifier());
            if (!compose::LayerRegistry::exists(file)) continue;
            add_knot(time, times);
            active.emplace_back(draft_->to_stage.apply(time + offset.value_or(0.0)),
                                double(assets.size()));
            assets.push_back(asset);
        }
        if (offset) add_knot(*last + std::abs(*offset), times);
        return true;
    }

    void add_knot(double time, std::vector<Vec2d>& times) const {
        times.emplace_back(draft_->to_stage.apply(time), time);
    }

    bool read_active(const std::vector<std::string>& assets,
                     std::vector<Vec2d> active,
                     ClipDefinition& out) {
        if (std::find(assets.begin(), assets.end(), "") != assets.end())
            return bad("an asset path is empty");
        std::sort(active.begin(), active.end(),
                  [](const Vec2d& a, const Vec2d& b) { return a.x < b.x; });
        for (size_t i = 0; i < active.size(); ++i) {
            const Vec2d& entry = active[i];
            if (!(entry.y >= 0.0 && entry.y < double(assets.size()))) {
                return bad(
                    fmt::format("clip {} is active, of {} asset paths", entry.y, assets.size()));
            }
            if (i > 0 && active[i - 1].x == entry.x)
                return bad(fmt::format("two clips are active at time {}", entry.x));
            Clip clip;
            clip.asset = assets[size_t(entry.y)];
            clip.authored_start = entry.x;
            clip.start = i == 0 ? -no_limit : entry.x;
            clip.end = i + 1 < active.size() ? active[i + 1].x : no_limit;
            out.clips.push_back(clip);
        }
        return true;
    }

    bool read_times(std::vector<Vec2d> times, ClipDefinition& out) {
        std::stable_sort(times.begin(), times.end(),
                         [](const Vec2d& a, const Vec2d& b) { return a.x < b.x; });
        for (size_t i = 0; i < times.size(); ++i) {
            if (i >= 2 && times[i].x == times[i - 2].x)
                return bad(fmt::format("times has more than two entries at time {}", times[i].x));
            ClipTiming point{times[i].x, times[i].y, false};
            if (i + 1 < times.size() && times[i + 1].x == times[i].x) {
                point.external -= clip_jump_step;
                point.before_jump = true;
            }
            out.times.push_back(point);
        }
        return true;
    }

    const PrimData& prim_;
    const compose::LayerRegistry& registry_;
    Diagnostics& diagnostics_;
    const Draft* draft_ = nullptr;
    std::string name_;
};

}  // namespace

std::vector<ClipDefinition> read_clip_definitions(const PrimData& prim,
                                                  const compose::LayerRegistry& registry,
                                                  Diagnostics& diagnostics) {
    Drafts composed;
    int rank = 0;
    for (const int i : prim.index.contributing()) {
        const compose::Node& node = prim.index.nodes()[size_t(i)];
        for (const auto& [name, draft] : SiteReader(prim, node, rank++, diagnostics).read()) {
            Draft& whole = composed[name];
            // Stronger sites come first: their entries and their anchor stay
            Dictionary info = whole.info.merged_over(draft.info);
            if (!whole.stack) whole = draft;
            whole.info = std::move(info);
        }
    }
    std::vector<std::pair<std::string, Draft>> sorted;
    for (const auto& [name, draft] : composed) {
        if (draft.stack) sorted.emplace_back(name, draft);
    }
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        return std::tie(a.second.node_rank, a.second.order) <
               std::tie(b.second.node_rank, b.second.order);
    });
    std::vector<ClipDefinition> result;
    DefinitionBuilder builder(prim, registry, diagnostics);
    for (const auto& [name, draft] : sorted) {
        ClipDefinition definition;
        // A set without clips still hides weaker sets of its name, but has no values
        if (builder.build(name, draft, definition) && !definition.clips.empty())
            result.push_back(std::move(definition));
    }
    return result;
}

}  // namespace velatura::usd::stage
