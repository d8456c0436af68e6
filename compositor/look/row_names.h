// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace look {

/// Cells of the bounce × group × lobe matrix, [column][group][lobe]: those that a name stands for.
using Selection = std::vector<bool>;

/// What names mean in a file: rows (groups), columns (bounces), lobes, casters, and the look's own
/// sets.
class RowNames {
  public:
    RowNames(const LayerStack& stack, const Look& look);

    /// At least 1: a file that does not tell bounces (or groups, or lobes) apart has one for
    /// everything.
    size_t column_count() const { return columns_.size(); }

    size_t group_count() const { return groups_.size(); }

    size_t lobe_count() const { return lobes_.size(); }

    size_t cell_count() const { return columns_.size() * groups_.size() * lobes_.size(); }

    /// The place of a cell in a Selection.
    size_t cell(size_t column, size_t group, size_t lobe = 0) const {
        return (column * groups_.size() + group) * lobes_.size() + lobe;
    }

    size_t group_of_cell(size_t cell) const { return cell / lobes_.size() % groups_.size(); }

    /// Those whose light a layer holds: one for the finest, whole rows of those that tell less
    /// apart.
    std::vector<size_t> cells_of(const accumulate::LayerEntry& entry) const;

    const std::string& group_name(size_t g) const { return groups_[g]; }

    const std::vector<std::string>& group_names() const { return groups_; }

    const std::vector<std::string>& column_names() const { return columns_; }

    const std::vector<std::string>& lobe_names() const { return lobes_; }

    /// 0 for other names.
    size_t column_of(const std::string& name) const;
    size_t group_of(const std::string& name) const;
    size_t lobe_of(const std::string& name) const;
    /// The one that direct light is in: `b1`, or `tail` where bounces are not counted (K = 0).
    size_t direct_column() const;

    /// True for a row of the file, which comes before what the name would mean as a word.
    bool is_row(const std::string& name) const;

    /// A set of the look, a row, a word, a bounce, a lobe, or several of these with colons, such as
    /// GROUP:BOUNCE and GROUP:LOBE:BOUNCE, for what they have in common: the first that fits.
    /// Errors of these: "unknown-name", with the names that may have been meant.
    Result<Selection> select(const std::string& target) const;
    Result<std::vector<bool>> groups(const std::string& name) const;
    /// Layers of `GROUP:CASTER`. Errors: also "mix-not-stored" (no shadows by caster at all).
    Result<std::vector<std::string>> caster_layers(const std::string& target) const;

    /// Several unknown names as one error, with the names there are.
    Error unknown(const std::vector<Error>& errors) const;

  private:
    Selection selection(const std::vector<bool>& columns,
                        const std::vector<bool>& groups,
                        const std::vector<bool>& lobes) const;
    bool is_cell(size_t column, size_t lobe) const;
    bool select_columns(const std::string& name, std::vector<bool>& selected) const;
    bool select_groups(const std::string& name, std::vector<bool>& selected) const;
    bool select_lobes(const std::string& name, std::vector<bool>& selected) const;
    bool select_word(const std::string& name, Selection& selected) const;
    bool select_along(const std::string& name, Selection& selected) const;
    Result<Selection> select_set(const std::vector<std::string>& rows) const;
    Result<Selection> select_named(const std::string& target, bool has_sets) const;
    bool holds_cell(const Selection& selected) const;
    bool has_column(const std::string& name) const;
    Error unknown_name(const std::string& name) const;

    const LayerStack& stack_;
    std::map<std::string, std::vector<std::string>> sets_;
    std::vector<std::string> columns_, groups_, lobes_;
    bool names_columns_ = false, names_groups_ = false, names_lobes_ = false;
};

}  // namespace look
}  // namespace velatura::compositor
