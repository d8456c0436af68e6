// SPDX-License-Identifier: Apache-2.0
#include "base/unique_names.h"
#include "compositor/exports/export.h"
#include "compositor/exports/export_recipe.h"
#include "compositor/look/mattes.h"
#include "compositor/look/row_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

namespace velatura::compositor::exports {

namespace {

constexpr std::array<char, 3> channel_letters = {'r', 'g', 'b'};

/// For a script, between double quotes.
std::string tcl_quoted(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '\n') {
            quoted += "\\n";
            continue;
        }
        if (std::string_view("\"\\$[]").find(c) != std::string_view::npos) quoted += '\\';
        quoted += c;
    }
    return quoted + "\"";
}

/// For a knob whose text Nuke evaluates.
std::string knob_quoted(const std::string& text) {
    std::string quoted;
    for (const char c : text) {
        if (std::string_view("\\$[]").find(c) != std::string_view::npos) quoted += '\\';
        quoted += c;
    }
    return quoted;
}

/// Within the braces of a knob's definition.
std::string label_of(const std::string& text) {
    std::string label = text;
    for (char& c : label) {
        const bool is_special = std::string_view("{}[]$\"\\").find(c) != std::string_view::npos;
        if (is_special || std::iscntrl(uint8_t(c)) != 0) c = '_';
    }
    return "\"" + label + "\"";
}

/// What Nuke calls a layer of an EXR: the channel's layer, or the part's of bare channels, of
/// letters, digits and `_`.
std::string nuke_layer(const MixRecipe::Term& term) {
    if (term.layer == "rgba" && term.channels[0] == "R") return "rgba";
    const size_t dot = term.channels[0].rfind('.');
    if (dot == std::string::npos) return term.part.empty() ? "rgba" : plain_name(term.part);
    return plain_name(term.channels[0].substr(0, dot));
}

/// Relative names hold wherever script and file are moved together.
std::string file_knob(const std::string& file, const std::string& folder) {
    namespace fs = std::filesystem;
    if (fs::path(file).is_absolute()) return knob_quoted(file);
    if (folder.empty())
        return "[file dirname [value root.name]]/" +
               knob_quoted(fs::path(file).lexically_normal().generic_string());
    const fs::path from = fs::absolute(folder).lexically_normal();
    const fs::path to = fs::absolute(file).lexically_normal();
    return "[file dirname [value root.name]]/" +
           knob_quoted(to.lexically_relative(from).generic_string());
}

/// False for names that the knob matteList takes for something else: nothing, a number in <>, a
/// wildcard, more than one line.
bool is_listable(const std::string& name) {
    return !name.empty() && std::none_of(name.begin(), name.end(), [](char c) {
        return std::iscntrl(uint8_t(c)) != 0 ||
               std::string_view("<>*?[]").find(c) != std::string_view::npos;
    });
}

/// Names as the knob matteList lists them, others by their IDs.
std::string matte_list(const layers::Cryptomatte& matte, const std::vector<uint32_t>& ids) {
    std::string list;
    for (const uint32_t id : ids) {
        const auto named = std::find_if(matte.names.begin(), matte.names.end(),
                                        [id](const auto& n) { return n.id == id; });
        // A name counts by its hash, whatever the manifest says
        const bool is_known = named != matte.names.end() && layers::matte_id(named->name) == id;
        std::string item = is_known && is_listable(named->name)
                               ? named->name
                               : fmt::format("<{:.9g}>", std::bit_cast<float>(id));
        const bool is_plain = item.find_first_of(" ,\"\\") == std::string::npos;
        if (!is_plain) {
            std::string escaped;
            for (const char c : item) {
                if (c == '"' || c == '\\') escaped += '\\';
                escaped += c;
            }
            item = "\"" + escaped + "\"";
        }
        list += (list.empty() ? "" : ", ") + item;
    }
    return list;
}

/// A group of nodes with a knob per fader.
class NukeGroup {
  public:
    /// `others`: frames that store other layers.
    NukeGroup(const LayerStack& stack,
              const std::vector<LayerStack>& others,
              const mix::MixPlan& plan,
              const Look& look)
        : stack_(stack),
          others_(others),
          plan_(plan),
          look_(look),
          rows_(stack, look),
          has_lobes_(plan.family == "lobe-matrix"),
          has_groups_(has_lobes_ || plan.family == "matrix" || plan.family == "groups" ||
                      stack.is_plain()),
          has_bounces_(has_lobes_ || plan.family == "matrix" || plan.family == "bounces") {
        tab("Mixer");
        exposure_ = slider("exposure", "exposure (stops)", look.exposure_stops, -4, 4);
    }

    /// Errors: "export-matte".
    Result<void> build(const MixRecipe& file);
    std::string text(const MixRecipe& file) const;

    /// Of Nuke, that the nodes use; each once.
    const std::vector<std::string>& layers() const { return layers_; }

  private:
    using Factor = std::array<std::string, 3>;  ///< expressions of red, green, blue

    struct FaderKnobs {
        std::string gain, tint, mute;
    };

    struct Cell {
        size_t column = 0, group = 0, lobe = 0;

        auto operator<=>(const Cell&) const = default;
    };

    /// A multiplication where a matte is, or where it is not.
    struct Within {
        size_t matte = 0;
        bool is_outside = false;
        Factor factor;
    };

    std::string slider(
        const std::string& name, const std::string& label, float value, float min, float max);
    std::string color(const std::string& name,
                      const std::string& label,
                      const std::array<float, 3>& value);
    void tab(const std::string& label);
    FaderKnobs fader(const std::string& name, const Fader& fader);
    void add_faders();
    void add_trims();
    Cell cell_of(const accumulate::LayerEntry& entry) const;
    Cell direct_cell(const std::string& group) const;
    Factor factor(const Cell& cell) const;
    std::vector<Within> within(const Cell& cell) const;
    Result<void> add_mattes();
    void add_layer(const std::string& layer);
    void add_term(const std::string& layer, const Factor& factor, std::vector<Within> within);
    void add_family();
    void add_plain();
    Result<void> add_clamps();
    void add_shadows();
    void add_shadow(const accumulate::LayerEntry& entry, const mix::MixPlan::Term* term);

    bool is_stored(const std::string& layer) const {
        return stored_term(stack_, others_, layer).has_value();
    }

    const LayerStack& stack_;
    const std::vector<LayerStack>& others_;
    const mix::MixPlan& plan_;
    const Look& look_;
    RowNames rows_;
    const bool has_lobes_, has_groups_, has_bounces_;
    UniqueNames knob_names_, node_names_;
    std::string knobs_, nodes_;
    std::vector<std::string> layers_;
    std::string exposure_;
    FaderKnobs all_;
    std::vector<FaderKnobs> groups_, bounces_, lobes_;
    std::map<Cell, std::string> trims_;
    std::vector<std::string> matted_;  ///< knobs
    std::vector<bool> is_inverted_;    ///< per matte
    bool has_term_ = false;
    std::string alpha_layer_ = "rgba";
};

std::string NukeGroup::slider(
    const std::string& name, const std::string& label, float value, float min, float max) {
    const std::string knob = knob_names_.make(name);
    knobs_ += fmt::format(" addUserKnob {{7 {} l {} R {} {}}}\n {} {}\n", knob, label_of(label),
                          min, max, knob, value);
    return knob;
}

std::string NukeGroup::color(const std::string& name,
                             const std::string& label,
                             const std::array<float, 3>& value) {
    const std::string knob = knob_names_.make(name);
    knobs_ += fmt::format(" addUserKnob {{18 {} l {} R 0 4}}\n {} {{{} {} {}}}\n", knob,
                          label_of(label), knob, value[0], value[1], value[2]);
    return knob;
}

void NukeGroup::tab(const std::string& label) {
    knobs_ += fmt::format(" addUserKnob {{20 tab_{} l {}}}\n", label, label);
}

NukeGroup::FaderKnobs NukeGroup::fader(const std::string& name, const Fader& fader) {
    FaderKnobs knobs;
    const std::string plain = plain_name(name);
    knobs.gain = slider("gain_" + plain, name, fader.gain, 0, 4);
    knobs.tint = color("tint_" + plain, name + " tint", fader.tint);
    knobs.mute = knob_names_.make("mute_" + plain);
    knobs_ += fmt::format(" addUserKnob {{6 {} l {} +STARTLINE}}\n {} {}\n", knobs.mute,
                          label_of(name + " mute"), knobs.mute, fader.is_muted ? "true" : "false");
    return knobs;
}

void NukeGroup::add_faders() {
    all_ = fader("all", plan_.faders.all);
    if (has_groups_)
        for (const Fader& f : plan_.faders.groups) groups_.push_back(fader(f.name, f));
    if (has_bounces_) tab("Bounces");
    for (size_t b = 0; b < plan_.faders.bounces.size() && has_bounces_; ++b)
        bounces_.push_back(fader(plan_.faders.bounces[b].name, plan_.faders.bounces[b]));
    if (!has_lobes_) return;
    tab("Lobes");
    for (const Fader& f : plan_.faders.lobes) lobes_.push_back(fader(f.name, f));
}

/// Where the family tells groups or bounces not apart, any of them stands for all.
NukeGroup::Cell NukeGroup::cell_of(const accumulate::LayerEntry& entry) const {
    return {has_bounces_ ? rows_.column_of(entry.bounce) : 0,
            has_groups_ ? rows_.group_of(entry.group) : 0, rows_.lobe_of(entry.lobe)};
}

/// Of light that shadows take away. They are not stored by lobe: the first after emission.
NukeGroup::Cell NukeGroup::direct_cell(const std::string& group) const {
    return {has_bounces_ ? rows_.direct_column() : 0, has_groups_ ? rows_.group_of(group) : 0,
            has_lobes_ ? size_t(1) : 0};
}

/// What a look says of single lobes of single bounces of single groups, or of rows that have no
/// fader here.
void NukeGroup::add_trims() {
    const Faders& faders = plan_.faders;
    const auto add = [&](const Cell& cell) {
        const auto& [b, g, l] = cell;
        std::array<float, 3> value = faders.cells[faders.place(b, g, l)];
        for (size_t c = 0; c < 3; ++c) {
            if (!has_groups_) value[c] *= faders.groups[g].factor()[c];
            if (!has_bounces_) value[c] *= faders.bounces[b].factor()[c];
        }
        // A knob for each lobe as well would be hundreds
        const bool is_unit = value == std::array<float, 3>{1, 1, 1};
        if (is_unit && plan_.family != "matrix") return;
        std::string name, label;
        for (const std::string& part :
             {has_groups_ ? faders.groups[g].name : std::string(), faders.lobes[l].name,
              has_bounces_ ? faders.bounces[b].name : std::string()}) {
            if (part.empty()) continue;
            name += "_" + part;
            label += (label.empty() ? "" : ":") + part;
        }
        if (trims_.empty()) tab("Cells");
        trims_[cell] = color("cell" + plain_name(name),
                             has_groups_ && has_bounces_ ? label : label + " trim", value);
    };
    for (size_t b = 0; b < (has_bounces_ ? faders.bounces.size() : 1); ++b)
        for (size_t g = 0; g < (has_groups_ ? faders.groups.size() : 1); ++g)
            for (size_t l = 0; l < faders.lobes.size(); ++l) add({b, g, l});
}

NukeGroup::Factor NukeGroup::factor(const Cell& cell) const {
    const auto trim = trims_.find(cell);
    Factor factor;
    for (size_t c = 0; c < 3; ++c) {
        std::string& text = factor[c];
        const auto multiply = [&](const FaderKnobs& knobs) {
            text += fmt::format("*parent.{}*parent.{}.{}*(1-parent.{})", knobs.gain, knobs.tint,
                                channel_letters[c], knobs.mute);
        };
        text = fmt::format("pow(2,parent.{})", exposure_);
        multiply(all_);
        if (has_groups_) multiply(groups_[cell.group]);
        if (has_bounces_) multiply(bounces_[cell.column]);
        if (has_lobes_) multiply(lobes_[cell.lobe]);
        if (trim != trims_.end())
            text += fmt::format("*parent.{}.{}", trim->second, channel_letters[c]);
    }
    return factor;
}

std::vector<NukeGroup::Within> NukeGroup::within(const Cell& cell) const {
    std::vector<Within> list;
    for (size_t m = 0; m < matted_.size(); ++m) {
        const MattedFader& f = plan_.faders.matted[m];
        if (!f.cells[plan_.faders.place(cell.column, cell.group, cell.lobe)]) continue;
        Within& w = list.emplace_back();
        w.matte = f.matte;
        w.is_outside = is_inverted_[f.matte];
        for (size_t c = 0; c < 3; ++c)
            w.factor[c] = fmt::format("parent.{}.{}", matted_[m], channel_letters[c]);
    }
    return list;
}

/// A node per Cryptomatte that the look cuts, and a knob per control within it.
Result<void> NukeGroup::add_mattes() {
    if (plan_.mattes.empty()) return {};
    tab("Mattes");
    for (size_t m = 0; m < plan_.mattes.size(); ++m) {
        const std::string& text = plan_.mattes[m].text;
        const auto cut = matte_ids_of(stack_, text);
        if (!cut) return cut.error();
        if (!*cut)
            return Error{
                "export-matte",
                fmt::format(
                    "the matte {} is an image; only Cryptomattes of the file can be exported",
                    text)};
        const auto& [is_inverted, matte, ids] = **cut;
        is_inverted_.push_back(is_inverted);
        std::vector<std::string> levels;
        for (const image::Part& part : stack_.image().parts) {
            for (const image::Channel& c : part.channels) {
                const std::string level = c.name.substr(0, c.name.rfind('.'));
                const bool is_level = level.size() == matte.layer.size() + 2 &&
                                      level.starts_with(matte.layer) &&
                                      std::isdigit(uint8_t(level.back())) != 0;
                if (is_level && std::find(levels.begin(), levels.end(), level) == levels.end())
                    levels.push_back(level);
            }
        }
        std::sort(levels.begin(), levels.end());
        // What the node of before Nuke 13 reads; later ones have the names alone
        std::string expression;
        for (const std::string& level : levels) {
            const std::string name = plain_name(level);
            add_layer(name);
            for (const auto& [id_of, coverage] :
                 {std::pair{"red", "green"}, std::pair{"blue", "alpha"}}) {
                std::string condition;
                for (const uint32_t id : ids)
                    condition += fmt::format("{}{}.{} == {:.9g}", condition.empty() ? "" : " || ",
                                             name, id_of, std::bit_cast<float>(id));
                expression += fmt::format("(({}) ? {}.{} : 0.0) + ", condition, name, coverage);
            }
        }
        nodes_ += fmt::format(
            "push $layers\n Cryptomatte {{\n  matteOutput alpha\n  matteList {}\n  cryptoLayer "
            "{}\n  expression {}\n  name matte_{}\n }}\n Clamp {{\n  channels alpha\n  name "
            "clamped_{}\n }}\nset matte_{} [stack 0]\n",
            tcl_quoted(knob_quoted(matte_list(matte, ids))), tcl_quoted(matte.layer),
            tcl_quoted(expression + "0"), m + 1, m + 1, m + 1);
    }
    for (const MattedFader& f : plan_.faders.matted)
        matted_.push_back(color("within_" + plain_name(f.target),
                                f.target + " in " + plan_.mattes[f.matte].text, f.gain));
    return {};
}

void NukeGroup::add_layer(const std::string& layer) {
    if (layer != "rgba" && std::find(layers_.begin(), layers_.end(), layer) == layers_.end())
        layers_.push_back(layer);
}

void NukeGroup::add_term(const std::string& layer,
                         const Factor& factor,
                         std::vector<Within> within) {
    const auto stored = stored_term(stack_, others_, layer);
    if (!stored) return;
    const std::string of = nuke_layer(*stored), name = node_names_.make(plain_name(layer));
    add_layer(of);
    // The first matte is on top
    for (size_t w = within.size(); w-- > 0;)
        nodes_ += fmt::format("push $matte_{}\n", within[w].matte + 1);
    nodes_ += fmt::format(
        "push $layers\n Shuffle {{\n  in {}\n  alpha black\n  name take_{}\n }}\n", of, name);
    nodes_ += fmt::format(
        " Multiply {{\n  channels rgb\n  value {{{{{}}} {{{}}} {{{}}} 1}}\n  name gain_{}\n }}\n",
        factor[0], factor[1], factor[2], name);
    for (size_t w = 0; w < within.size(); ++w) {
        nodes_ += fmt::format(
            " Multiply {{\n  inputs 1+1\n  channels rgb\n  value {{{{{}}} {{{}}} {{{}}} 1}}\n"
            "  maskChannelInput rgba.alpha\n{}  name within_{}_{}\n }}\n",
            within[w].factor[0], within[w].factor[1], within[w].factor[2],
            within[w].is_outside ? "  invert_mask true\n" : "", w + 1, name);
    }
    if (has_term_)
        nodes_ += fmt::format(
            " Merge2 {{\n  inputs 2\n  operation plus\n  output rgb\n  name add_{}\n }}\n", name);
    has_term_ = true;
}

void NukeGroup::add_family() {
    std::vector<mix::MixPlan::Term> terms = plan_.terms;
    for (const LayerStack& other : others_) {
        if (const auto of_frame = mix::plan_gains(other, look_))
            add_missing_terms(of_frame->terms, stack_.header(), terms);
    }
    for (const mix::MixPlan::Term& term : terms) {
        const accumulate::LayerEntry* e = stack_.header().find(term.layer);
        const Cell cell = e ? cell_of(*e) : Cell();
        add_term(term.layer, factor(cell), within(cell));
    }
}

/// The beauty is the rows and the rest: the rest's gain of it, and what rows differ from that.
void NukeGroup::add_plain() {
    if (!stack_.has_beauty()) {
        for (const accumulate::LayerEntry& e : stack_.header().layers) {
            const Cell cell{0, rows_.group_of(e.group)};
            if (e.family == "plain") add_term(e.name, factor(cell), within(cell));
        }
        return;
    }
    const Cell rest{0, rows_.group_count() - 1};
    const Factor of_rest = factor(rest);
    add_term("rgba", of_rest, within(rest));
    for (const accumulate::LayerEntry& e : stack_.header().layers) {
        if (e.family != "plain") continue;
        const Cell cell{0, rows_.group_of(e.group)};
        Factor gain = factor(cell), less;
        for (size_t c = 0; c < 3; ++c) less[c] = "-(" + of_rest[c] + ")";
        if (matted_.empty()) {
            for (size_t c = 0; c < 3; ++c) gain[c] += less[c];
            add_term(e.name, gain, {});
            continue;
        }
        add_term(e.name, gain, within(cell));
        add_term(e.name, less, within(rest));
    }
}

/// What clamps took, to be given back.
Result<void> NukeGroup::add_clamps() {
    bool has_clamps = false;
    for (const accumulate::LayerEntry& e : stack_.header().layers) {
        const accumulate::LayerEntry* of =
            e.family == "clamp" ? stack_.header().find(e.of) : nullptr;
        if (!of || of->family != plan_.family || !is_stored(e.name)) continue;
        float share = 0;
        for (const mix::MixPlan::Term& term : plan_.terms) {
            if (term.clamp_layer != e.name) continue;
            for (const mix::MattedShare& s : term.clamp_shares) {
                if (s.matte != mix::whole_image)
                    return Error{"export-matte",
                                 "--clamp within a matte is not supported by the script; remove "
                                 "its --matte, or mix to .exr"};
                share = std::max(share, s.share);
            }
        }
        if (!has_clamps) tab("Clamps");
        has_clamps = true;
        const std::string knob = slider(plain_name(e.name), of->name, share, 0, 1);
        Factor gain = factor(cell_of(e));
        for (std::string& text : gain) text += "*parent." + knob;
        add_term(e.name, gain, within(cell_of(e)));
    }
    return {};
}

void NukeGroup::add_shadow(const accumulate::LayerEntry& entry, const mix::MixPlan::Term* term) {
    const Cell cell = direct_cell(entry.group);
    const std::string name = entry.caster.empty() ? entry.group : entry.group + ":" + entry.caster;
    std::vector<mix::MattedShare> lifts = term ? term->lifts : std::vector<mix::MattedShare>();
    const bool has_whole = std::any_of(lifts.begin(), lifts.end(), [](const mix::MattedShare& l) {
        return l.matte == mix::whole_image;
    });
    if (!has_whole && entry.caster.empty()) lifts.insert(lifts.begin(), {mix::whole_image, 0});
    for (const mix::MattedShare& lift : lifts) {
        const bool is_whole = lift.matte == mix::whole_image;
        const std::string label = is_whole ? name : name + " in " + plan_.mattes[lift.matte].text;
        const std::string knob = slider("shadow_" + plain_name(name), label, lift.share, 0, 1);
        Factor gain = factor(cell);
        for (std::string& text : gain) text += "*parent." + knob;
        std::vector<Within> list = within(cell);
        // Nothing where the matte is not
        if (!is_whole) list.push_back({lift.matte, !is_inverted_[lift.matte], {"0", "0", "0"}});
        add_term(entry.name, gain, std::move(list));
    }
}

void NukeGroup::add_shadows() {
    bool has_shadows = false;
    for (const char* family : {"shadow", "caster"}) {
        for (const accumulate::LayerEntry& e : stack_.header().layers) {
            if (e.family != family || !is_stored(e.name)) continue;
            const auto term = std::find_if(plan_.shadow_terms.begin(), plan_.shadow_terms.end(),
                                           [&](const auto& t) { return t.layer == e.name; });
            const bool is_lifted = term != plan_.shadow_terms.end();
            if (e.family == "caster" && !is_lifted) continue;
            if (!has_shadows) tab("Shadows");
            has_shadows = true;
            add_shadow(e, is_lifted ? &*term : nullptr);
        }
    }
}

Result<void> NukeGroup::build(const MixRecipe& file) {
    if (file.has_alpha) {
        const bool is_bare = file.alpha_channel.find('.') == std::string::npos;
        const MixRecipe::Term alpha{
            is_bare ? "rgba" : "", file.alpha_part, {}, {is_bare ? "R" : file.alpha_channel}};
        const auto beauty = stored_term(stack_, others_, "rgba");
        alpha_layer_ = nuke_layer(beauty ? *beauty : alpha);
        add_layer(alpha_layer_);
    }
    add_faders();
    add_trims();
    if (auto done = add_mattes(); !done) return done;
    if (stack_.is_plain())
        add_plain();
    else
        add_family();
    if (auto done = add_clamps(); !done) return done;
    add_shadows();
    return {};
}

std::string NukeGroup::text(const MixRecipe& file) const {
    std::string text = "Group {\n name Velatura_Mix\n" + knobs_ +
                       "}\n Input {\n  inputs 0\n  name Layers\n }\nset layers [stack 0]\n" +
                       nodes_;
    if (file.has_alpha)
        text += fmt::format(
            "set mix [stack 0]\npush $layers\npush $mix\n"
            " Copy {{\n  inputs 2\n  from0 {}.alpha\n  to0 rgba.alpha\n  name alpha\n }}\n",
            alpha_layer_);
    return text + " Output {\n  name Output1\n }\nend_group\n";
}

}  // namespace

Result<std::string> nuke_script(const LayerStack& stack,
                                const mix::MixPlan& plan,
                                const Look& look,
                                const std::string& file,
                                const std::string& folder) {
    const auto recipe = file_recipe(stack, look, file);
    if (!recipe) return recipe.error();
    const std::vector<LayerStack> others = other_frames(stack, file);
    NukeGroup group(stack, others, plan, look);
    if (auto built = group.build(*recipe); !built) return built.error();
    std::string script = "#! nuke\n" + comment(*recipe) + "version 12.0 v1\n";
    for (const std::string& layer : group.layers())
        script += fmt::format("add_layer {{{0} {0}.red {0}.green {0}.blue {0}.alpha}}\n", layer);
    script += fmt::format(
        "Read {{\n inputs 0\n file {}\n{} raw true\n name Layers\n}}\n",
        tcl_quoted(file_knob(recipe->file, folder)),
        recipe->is_sequence ? fmt::format(" first {0}\n last {1}\n origfirst {0}\n origlast {1}\n",
                                          recipe->first_frame, recipe->last_frame)
                            : std::string());
    return script + group.text(*recipe);
}

}  // namespace velatura::compositor::exports
