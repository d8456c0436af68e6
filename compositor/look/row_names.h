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

/// Cells of the bounce × group matrix, [column][group]: those that a name stands for.
using Selection = std::vector<bool>;

/// What names mean in a file: rows (groups), columns (bounces), casters, and the look's own sets.
class RowNames {
  public:
    RowNames(const LayerStack& stack, const Look& look);

    /// At least 1: a file that does not tell bounces (or groups) apart has one for everything.
    size_t column_count() const { return columns_.size(); }

    size_t group_count() const { return groups_.size(); }

    const std::string& group_name(size_t g) const { return groups_[g]; }

    const std::vector<std::string>& group_names() const { return groups_; }

    const std::vector<std::string>& column_names() const { return columns_; }

    /// 0 for other names.
    size_t column_of(const std::string& name) const;
    size_t group_of(const std::string& name) const;
    /// The one that direct light is in: `b1`, or `tail` where bounces are not counted (K = 0).
    size_t direct_column() const;

    /// True for a row of the file, which comes before what the name would mean as a word.
    bool is_row(const std::string& name) const;

    /// A set of the look, a row, a word, a bounce, GROUP:BOUNCE: the first that fits.
    /// Errors of these: "unknown-name", with the names that may have been meant.
    Result<Selection> select(const std::string& target) const;
    Result<std::vector<bool>> groups(const std::string& name) const;
    /// Layers of `GROUP:CASTER`. Errors: also "mix-not-stored" (no shadows by caster at all).
    Result<std::vector<std::string>> caster_layers(const std::string& target) const;

    /// Several unknown names as one error, with the names there are.
    Error unknown(const std::vector<Error>& errors) const;

  private:
    Selection cells_of(const std::vector<bool>& columns, const std::vector<bool>& groups) const;
    bool select_columns(const std::string& name, std::vector<bool>& selected) const;
    bool select_groups(const std::string& name, std::vector<bool>& selected) const;
    Result<Selection> select_set(const std::vector<std::string>& rows,
                                 const std::string& bounce) const;
    Result<Selection> select_of_file(const std::string& target) const;
    bool has_column(const std::string& name) const;
    Error unknown_name(const std::string& name) const;

    const LayerStack& stack_;
    std::map<std::string, std::vector<std::string>> sets_;
    std::vector<std::string> columns_, groups_;
    bool names_columns_ = false, names_groups_ = false;
};

}  // namespace look
}  // namespace velatura::compositor
