// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/fit_look.h"

#include "compositor/look/row_names.h"
#include "compositor/mix/mix_plan.h"

#include <fmt/format.h>

#include <map>
#include <optional>

namespace velatura::compositor::mix {

namespace {

/// Which mattes can be had, each tried once.
class MatteProbe {
  public:
    MatteProbe(const LayerStack& stack, const layers::StripReader* file, size_t strip_bytes)
        : stack_(stack), file_(file), strip_bytes_(strip_bytes) {}

    std::optional<Error> fault_of(const std::string& matte) {
        if (matte.empty()) return std::nullopt;
        const auto [at, is_new] = faults_.try_emplace(matte);
        if (!is_new) return at->second;
        if (const auto loaded = load_matte(stack_, file_, matte, strip_bytes_); !loaded)
            at->second = loaded.error();
        return at->second;
    }

  private:
    const LayerStack& stack_;
    const layers::StripReader* file_;
    const size_t strip_bytes_;
    std::map<std::string, std::optional<Error>> faults_;
};

}  // namespace

FittedLook fit_look(const LayerStack& stack,
                    const Look& look,
                    const layers::StripReader* file,
                    size_t strip_bytes) {
    FittedLook fitted;
    fitted.look = look;
    // Rows first: a set of them without those that are not here is still that set
    for (auto& [name, rows] : fitted.look.rows) {
        std::erase_if(rows, [&, &name = name](const std::string& row) {
            const Look none;
            const auto selected = RowNames(stack, none).select(row);
            if (selected) return false;
            fitted.omitted.push_back(
                fmt::format("{} of --rows {}: {}", row, name, selected.error().message));
            return true;
        });
    }
    std::erase_if(fitted.look.rows, [](const auto& entry) { return entry.second.empty(); });
    MatteProbe mattes(stack, file, strip_bytes);
    const auto fault_of = [&](const Look& part) -> std::optional<Error> {
        for (const Control& control : part.controls) {
            if (auto fault = mattes.fault_of(control.matte)) return fault;
        }
        const auto plan = plan_gains(stack, part, true);
        return plan ? std::nullopt : std::optional<Error>(plan.error());
    };
    // What one control alone may not do, a later one may make possible: all of them first
    if (!fault_of(fitted.look)) return fitted;
    fitted.look.controls.clear();
    for (const Control& control : look.controls) {
        fitted.look.controls.push_back(control);
        const auto fault = fault_of(fitted.look);
        if (!fault) continue;
        fitted.look.controls.pop_back();
        fitted.omitted.push_back(
            fmt::format("--{} {}: {}", name_of(control.kind), control.target, fault->message));
    }
    return fitted;
}

}  // namespace velatura::compositor::mix
