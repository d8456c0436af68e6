// SPDX-License-Identifier: Apache-2.0
#include "pcp_baseline.h"

#include "../usd/compose/property_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

namespace velatura::usd::compose {

namespace fs = std::filesystem;

namespace {

/// "['a', 'b']" → a, b
std::vector<std::string> list_items(const std::string& line) {
    std::vector<std::string> items;
    for (size_t open = line.find('\''); open != std::string::npos;) {
        const size_t close = line.find('\'', open + 1);
        if (close == std::string::npos) break;
        items.push_back(line.substr(open + 1, close - open - 1));
        open = line.find('\'', close + 1);
    }
    return items;
}

/// Words of a line joined by single spaces.
std::string squeezed(const std::string& line) {
    std::istringstream words(line);
    std::string result, word;
    while (words >> word) result += (result.empty() ? "" : " ") + word;
    return result;
}

/// The kind of error a line of text tells of; empty for lines that go with another one.
std::string error_of(const std::string& line) {
    static const std::vector<std::pair<std::string, ErrorKind>> phrases = {
        {"Cycle detected:", ErrorKind::ArcCycle},
        {"which is a prohibited child", ErrorKind::ArcToProhibitedChild},
        {"has inconsistent spec types", ErrorKind::InconsistentPropertyType},
        {"Could not open asset", ErrorKind::InvalidAssetPath},
        {"is invalid and will be ignored", ErrorKind::InvalidAuthoredRelocation},
        {"conflicts with another relocation", ErrorKind::InvalidConflictingRelocation},
        {"to a path outside the scope", ErrorKind::InvalidExternalTargetPath},
        {"refers to an instance of that class", ErrorKind::InvalidInstanceTargetPath},
        {"must be an absolute prim path", ErrorKind::InvalidPrimPath},
        {"is the target of multiple relocations", ErrorKind::InvalidSameTargetRelocations},
        {"Invalid sublayer offset", ErrorKind::InvalidSublayerOffset},
        {"offset", ErrorKind::InvalidReferenceOffset},
        {"have the same owner", ErrorKind::InvalidSublayerOwnership},
        {"Could not load sublayer", ErrorKind::InvalidSublayerPath},
        {"invalid opinion at the relocation source", ErrorKind::OpinionAtRelocationSource},
        {"Sublayer hierarchy", ErrorKind::SublayerCycle},
        {"Unresolved ", ErrorKind::UnresolvedPrimPath},
        {"expression", ErrorKind::VariableExpression},
    };
    for (const auto& [phrase, kind] : phrases) {
        if (line.find(phrase) != std::string::npos) return std::string(error_name(kind));
    }
    return {};
}

bool is_section(const std::string& line) {
    static const std::set<std::string> names = {
        "Layer Stack:",           "Prim Stack:",          "Time Offsets:",
        "Variant Selections:",    "Child names:",         "Prohibited child names:",
        "Property names:",        "Property stacks:",     "Relationship targets:",
        "Attribute connections:", "Deleted target paths:"};
    return names.count(line) != 0;
}

class FactCollector {
  public:
    FactCollector(Composer& composer, const std::string& folder)
        : composer_(composer), folder_(folder) {}

    std::vector<std::pair<std::string, Sections>> collect() {
        Sections stack;
        for (const StackLayer& entry : composer_.root_stack()->layers())
            stack["Layer Stack"].push_back(label(entry));
        take_errors(stack);
        facts_.emplace_back("", std::move(stack));
        const PrimIndex root = composer_.root_index();
        for (const layer::Token& name : composer_.child_names(root, false))
            add_prim(composer_.child_index(root, name, false));
        return std::move(facts_);
    }

  private:
    std::string label(const StackLayer& entry) const {
        return fs::path(entry.layer->identifier()).lexically_relative(folder_).string();
    }

    void take_errors(Sections& sections) {
        const std::vector<CompositionError> errors = std::as_const(composer_).errors().all();
        for (; errors_ < errors.size(); ++errors_)
            sections["Errors"].emplace_back(error_name(errors[errors_].kind));
        if (sections.count("Errors") != 0)
            std::sort(sections["Errors"].begin(), sections["Errors"].end());
    }

    void add_time_offsets(const PrimIndex& index, Sections& sections) const {
        std::vector<std::string> lines;
        bool has_offset = false;
        for (const Node& n : index.nodes()) {
            const TimeOffset& t = n.to_root->time_offset();
            has_offset = has_offset || !n.to_parent->time_offset().is_identity();
            lines.push_back(fmt::format("{} {} {} (offset={:.2f}, scale={:.2f})",
                                        label(n.stack->layers().front()), n.path.to_string(),
                                        arc_name(n.arc), t.offset, t.scale));
            for (const StackLayer& entry : n.stack->layers()) {
                if (entry.to_root.is_identity()) continue;
                has_offset = true;
                lines.push_back(fmt::format("{} sublayer (offset={:.2f}, scale={:.2f})",
                                            label(entry), entry.to_root.offset,
                                            entry.to_root.scale));
            }
        }
        if (has_offset) sections["Time Offsets"] = lines;
    }

    void add_variants(const PrimIndex& index, Sections& sections) const {
        std::map<std::string, std::string> selections;
        for (const Node& n : index.nodes()) {
            if (n.path.is_variant_selection())
                selections.emplace(n.path.variant_set().str(), n.path.variant().str());
        }
        for (const auto& [set, variant] : selections)
            sections["Variant Selections"].push_back("{" + set + " = " + variant + "}");
    }

    void add_properties(const PrimIndex& index, Sections& sections) {
        std::map<std::string, std::vector<std::string>> stacks, relations, connections, deleted;
        for (const layer::Token& name : composer_.property_names(index)) {
            sections["Property names"].push_back(name.str());
            std::vector<CompositionError> errors;
            const std::vector<PropertySite> sites = property_stack(index, name, &errors);
            const std::string path = index.path().append_property(name).to_string();
            for (const PropertySite& site : sites) {
                const layer::Path spec =
                    index.nodes()[size_t(site.node)].path.append_property(name);
                stacks[path].push_back(label(*site.layer) + " " + spec.to_string());
            }
            if (sites.empty()) continue;
            ComposedTargets targets = compose_targets(index, name, sites, &composer_);
            errors.insert(errors.end(), targets.errors.begin(), targets.errors.end());
            for (const CompositionError& error : errors)
                sections["Errors"].emplace_back(error_name(error.kind));
            const bool is_attribute = sites.front().spec->kind() == layer::SpecKind::Attribute;
            for (const layer::Path& target : targets.paths)
                (is_attribute ? connections : relations)[path].push_back(target.to_string());
            for (const layer::Path& target : targets.deleted)
                deleted[path].push_back(target.to_string());
        }
        const auto print = [&](const char* section, const auto& map) {
            for (const auto& [path, lines] : map) {
                sections[section].push_back(path + ":");
                for (const std::string& line : lines) sections[section].push_back(line);
            }
        };
        print("Property stacks", stacks);
        print("Relationship targets", relations);
        print("Attribute connections", connections);
        print("Deleted target paths", deleted);
    }

    void add_prim(const PrimIndex& index) {
        Sections sections;
        take_errors(sections);
        sections["Prim Stack"];
        for (const int i : index.contributing()) {
            const Node& n = index.nodes()[size_t(i)];
            for (const StackLayer& entry : n.stack->layers()) {
                if (entry.layer->has_spec(n.path))
                    sections["Prim Stack"].push_back(label(entry) + " " + n.path.to_string());
            }
        }
        add_time_offsets(index, sections);
        add_variants(index, sections);
        // The baselines compose what is below instances, too
        const ChildNames names = composer_.all_child_names(index, index.is_instanceable());
        for (const layer::Token& name : names.names) sections["Child names"].push_back(name.str());
        for (const layer::Token& name : names.prohibited)
            sections["Prohibited child names"].push_back(name.str());
        add_properties(index, sections);
        // The reference composes targets of instances for their own sake: their errors are its
        errors_ = std::as_const(composer_).errors().all().size();
        if (sections.count("Errors") != 0)
            std::sort(sections["Errors"].begin(), sections["Errors"].end());
        facts_.emplace_back(index.path().to_string(), std::move(sections));
        for (const layer::Token& name : names.names)
            add_prim(composer_.child_index(index, name, index.is_instanceable()));
    }

    Composer& composer_;
    std::string folder_;
    size_t errors_ = 0;
    std::vector<std::pair<std::string, Sections>> facts_;
};

}  // namespace

Baseline parse_baseline(const std::string& text) {
    Baseline baseline;
    baseline.prims.emplace_back("", Sections());
    std::istringstream in(text);
    // Errors stand apart from the results of their prims
    std::map<std::string, std::vector<std::string>> errors;
    std::vector<std::string>* open_errors = nullptr;
    std::string section;
    for (std::string line; std::getline(in, line);) {
        Sections& sections = baseline.prims.back().second;
        if (line.starts_with("Loading @")) {
            const size_t start = line.find("/usda/") + 6;
            baseline.root_file = line.substr(start, line.rfind('@') - start);
        } else if (line.starts_with("Traceback")) {
            baseline.is_rejected = true;
        } else if (line.starts_with("Results for composing <")) {
            baseline.prims.emplace_back(line.substr(23, line.find('>') - 23), Sections());
            section.clear();
            open_errors = nullptr;
        } else if (line.starts_with("Errors while composing <")) {
            open_errors = &errors[line.substr(24, line.find('>') - 24)];
        } else if (line.starts_with("Errors while computing")) {
            open_errors = &errors[""];
        } else if (line.starts_with("----")) {
            open_errors = nullptr;
        } else if (open_errors) {
            const std::string kind = error_of(line);
            if (!kind.empty()) open_errors->push_back(kind);
        } else if (is_section(line)) {
            section = line.substr(0, line.size() - 1);
            sections[section];
        } else if (line.empty()) {
            section.clear();
        } else if (section.ends_with("names")) {
            sections[section] = list_items(line);
        } else if (!section.empty()) {
            sections[section].push_back(squeezed(line));
        }
    }
    for (auto& [path, sections] : baseline.prims) {
        const auto found = errors.find(path);
        if (found == errors.end()) continue;
        std::sort(found->second.begin(), found->second.end());
        sections["Errors"] = found->second;
    }
    return baseline;
}

std::vector<std::pair<std::string, Sections>> composed_facts(Composer& composer,
                                                             const std::string& folder) {
    return FactCollector(composer, folder).collect();
}

std::vector<std::string> differences(const std::vector<std::pair<std::string, Sections>>& expected,
                                     const std::vector<std::pair<std::string, Sections>>& ours) {
    std::vector<std::string> result;
    std::map<std::string, Sections> by_path(ours.begin(), ours.end());
    for (const auto& [path, sections] : expected) {
        const auto found = by_path.find(path);
        if (found == by_path.end()) {
            result.push_back(path + " is missing");
            continue;
        }
        std::set<std::string> names;
        for (const auto& section : sections) names.insert(section.first);
        for (const auto& section : found->second) names.insert(section.first);
        for (const std::string& name : names) {
            const auto get = [&](const Sections& from) {
                const auto it = from.find(name);
                return it == from.end() ? std::vector<std::string>() : it->second;
            };
            const std::vector<std::string> wanted = get(sections);
            const std::vector<std::string> have = get(found->second);
            if (wanted == have) continue;
            result.push_back(fmt::format("{} {}:\n      expected {}\n      ours     {}", path, name,
                                         fmt::join(wanted, " | "), fmt::join(have, " | ")));
        }
        by_path.erase(found);
    }
    for (const auto& extra : by_path) result.push_back(extra.first + " should not be there");
    return result;
}

}  // namespace velatura::usd::compose
