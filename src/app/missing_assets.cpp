// SPDX-License-Identifier: Apache-2.0
#include "app/missing_assets.h"

#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/progress.h"
#include "base/result.h"
#include "plugin/registry.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <vector>

namespace velatura::app {

namespace {

struct Found {
    std::atomic<MissingAssets> policy{MissingAssets::Fail};
    std::array<std::atomic<size_t>, std::size(missing_asset_codes)> counts{};
    std::mutex mutex;
    std::set<std::string> names;
};

Found& found() {
    static Found instance;
    return instance;
}

/// Of a scene that misses more, a header says no more.
constexpr size_t max_names = 256;

/// The first name in the message between @, ' or ", without its folder; empty if there is none.
std::string quoted_name(const std::string& message) {
    const size_t begin = message.find_first_of("@'\"");
    if (begin == std::string::npos) return {};
    const size_t end = message.find(message[begin], begin + 1);
    if (end == std::string::npos) return {};
    const std::string path = message.substr(begin + 1, end - begin - 1);
    return path.substr(path.rfind('/') + 1);
}

}  // namespace

void set_missing_assets(MissingAssets policy) {
    found().policy = policy;
}

MissingAssetsOfReload::MissingAssetsOfReload() {
    for (auto& count : found().counts) counts_.push_back(count.exchange(0));
    const std::lock_guard lock(found().mutex);
    names_.swap(found().names);
}

MissingAssetsOfReload::~MissingAssetsOfReload() {
    if (is_accepted_) return;
    for (size_t i = 0; i < counts_.size(); ++i) found().counts[i] = counts_[i];
    const std::lock_guard lock(found().mutex);
    names_.swap(found().names);
}

void note_missing_asset(const Diagnostic& diagnostic) {
    if (diagnostic.severity != Severity::Error) return;
    for (size_t i = 0; i < std::size(missing_asset_codes); ++i) {
        if (missing_asset_codes[i].code != diagnostic.code) continue;
        ++found().counts[i];
        const std::string name = quoted_name(diagnostic.message);
        const std::lock_guard lock(found().mutex);
        if (found().names.size() < max_names)
            found().names.insert(
                name.empty()
                    ? fmt::format("{} of <{}>", missing_asset_codes[i].kind, diagnostic.prim_path)
                    : fmt::format("{} {}", missing_asset_codes[i].kind, name));
    }
}

std::vector<std::string> missing_asset_names() {
    std::vector<std::string> names;
    for (const std::string& plugin : plugin::unavailable_plugin_names())
        names.push_back("plugin " + plugin);
    const std::lock_guard lock(found().mutex);
    names.insert(names.end(), found().names.begin(), found().names.end());
    return names;
}

std::string missing_assets_text() {
    std::map<std::string_view, size_t> by_kind;
    for (size_t i = 0; i < std::size(missing_asset_codes); ++i)
        if (const size_t count = found().counts[i]; count > 0)
            by_kind[missing_asset_codes[i].kind] += count;
    std::string text;
    for (const auto& [kind, count] : by_kind)
        text += (text.empty() ? "" : ", ") + format_count(count, kind);
    return text;
}

int exit_code_with_missing_assets(int code) {
    const bool is_ignored = found().policy == MissingAssets::Ignore;
    const std::vector<Error> plugins = plugin::unavailable_plugins();
    for (const Error& why : plugins) {
        const std::string text = fmt::format(
            "the scene needs a plugin that is not installed: {} [{}]", why.message, why.code);
        fmt::print(stderr, "{}: {}\n", is_ignored ? "warning" : "error", text);
        if (!is_ignored) note_error(text);
    }
    if (is_ignored) return code;
    const std::string text = missing_assets_text();
    // Of a command that failed, the messages before this one state what became of the output
    const bool has_result = code == Done || code == TargetMissed || code == CheckFailed;
    if (!text.empty()) note_error(fmt::format("missing assets: {} [missing-assets]", text));
    if (!text.empty() && has_result)
        fmt::print(stderr,
                   "error: missing assets: {}; the result lacks them; exit code {} "
                   "(--missing-assets ignore accepts this) [missing-assets]\n",
                   text, worse_exit_code(code, RenderError));
    else if (!text.empty())
        fmt::print(stderr, "error: missing assets: {} [missing-assets]\n", text);
    return plugins.empty() && text.empty() ? code : worse_exit_code(code, RenderError);
}

}  // namespace velatura::app
