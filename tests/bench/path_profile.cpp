// SPDX-License-Identifier: Apache-2.0
#include "path_profile.h"

#include <cxxabi.h>
#include <dlfcn.h>
#include <elf.h>
#include <link.h>
#include <linux/perf_event.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::bench {

namespace {

constexpr size_t max_samples = size_t(1) << 18;
std::vector<uintptr_t> samples;
std::atomic<size_t> sample_count = 0;

void note_place(int, siginfo_t*, void* context) {
    const size_t i = sample_count.fetch_add(1, std::memory_order_relaxed);
    if (i >= max_samples) return;
#if defined(__x86_64__)
    samples[i] = uintptr_t(static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_RIP]);
#elif defined(__aarch64__)
    samples[i] = uintptr_t(static_cast<ucontext_t*>(context)->uc_mcontext.pc);
#else
    static_cast<void>(context);
#endif
}

struct Function {
    uintptr_t begin, end;
    std::string name;
};

template <class T>
const T* at(const std::string& bytes, size_t offset) {
    return offset + sizeof(T) <= bytes.size() ? reinterpret_cast<const T*>(bytes.data() + offset)
                                              : nullptr;
}

/// The functions of this program by address, from the symbol table of its file.
std::vector<Function> own_functions() {
    uintptr_t base = 0;
    dl_iterate_phdr(
        [](dl_phdr_info* info, size_t, void* out) {
            *static_cast<uintptr_t*>(out) = info->dlpi_addr;
            return 1;  // the program itself comes first
        },
        &base);
    std::ifstream file("/proc/self/exe", std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    std::vector<Function> functions;
    const auto* header = at<Elf64_Ehdr>(bytes, 0);
    if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0) return functions;
    for (size_t s = 0; s < header->e_shnum; ++s) {
        const auto* table = at<Elf64_Shdr>(bytes, header->e_shoff + s * sizeof(Elf64_Shdr));
        if (!table || table->sh_type != SHT_SYMTAB) continue;
        const auto* names =
            at<Elf64_Shdr>(bytes, header->e_shoff + table->sh_link * sizeof(Elf64_Shdr));
        for (size_t i = 0; names && i < table->sh_size / sizeof(Elf64_Sym); ++i) {
            const auto* symbol = at<Elf64_Sym>(bytes, table->sh_offset + i * sizeof(Elf64_Sym));
            if (!symbol || ELF64_ST_TYPE(symbol->st_info) != STT_FUNC || symbol->st_size == 0)
                continue;
            const uintptr_t begin = base + symbol->st_value;
            functions.push_back({begin, begin + symbol->st_size,
                                 bytes.data() + names->sh_offset + symbol->st_name});
        }
    }
    std::sort(functions.begin(), functions.end(),
              [](const Function& a, const Function& b) { return a.begin < b.begin; });
    return functions;
}

std::string readable(const std::string& name) {
    int status = 0;
    char* text = abi::__cxa_demangle(name.c_str(), nullptr, nullptr, &status);
    std::string out = status == 0 ? text : name;
    std::free(text);
    return out;
}

Part part_of_function(const std::string& name) {
    const auto has = [&name](std::string_view word) { return name.find(word) != name.npos; };
    // The name itself comes before its arguments, whose types are of other tiers
    const size_t tier = name.find("velatura::");
    if (tier == name.npos) return Part::Other;
    const std::string_view from(name.c_str() + tier + 10);
    const auto is_in = [from](std::string_view space) {
        return from.substr(0, space.size()) == space;
    };
    if (has("TextureCache") || is_in("openimageio::")) return Part::Texture;
    if (is_in("accel::")) return Part::Tracing;
    if (is_in("geometry::Quadric::") && !has("Quadric::surface")) return Part::Tracing;
    if (is_in("geometry::")) return Part::Surfaces;
    if (is_in("shading::")) return Part::Shading;
    if (is_in("lights::")) return Part::Lights;
    if (is_in("sampling::") || is_in("camera::")) return Part::Sampling;
    if (is_in("film::") || is_in("image::")) return Part::Film;
    return Part::Loop;
}

Part part_of_library(uintptr_t place) {
    Dl_info info{};
    if (dladdr(reinterpret_cast<void*>(place), &info) == 0 || !info.dli_fname) return Part::Other;
    const std::string_view file(info.dli_fname);
    const bool is_texture =
        file.find("openimageio") != file.npos || file.find("OpenImageIO") != file.npos;
    return is_texture ? Part::Texture : Part::Other;
}

}  // namespace

const char* name_of(Part part) {
    static constexpr const char* names[] = {"tracing",  "surfaces", "shading", "texture", "lights",
                                            "sampling", "film",     "loop",    "other"};
    return names[size_t(part)];
}

Shares profile(const std::function<void()>& work) {
    samples.assign(max_samples, 0);
    sample_count = 0;

    struct sigaction action {
    }, before{};

    action.sa_sigaction = note_place;
    action.sa_flags = SA_SIGINFO | SA_RESTART;
    sigaction(SIGALRM, &action, &before);
    const itimerval often{{0, 500}, {0, 500}}, never{};
    setitimer(ITIMER_REAL, &often, nullptr);
    work();
    setitimer(ITIMER_REAL, &never, nullptr);
    sigaction(SIGALRM, &before, nullptr);

    const std::vector<Function> functions = own_functions();
    Shares shares{};
    const size_t count = std::min(sample_count.load(), max_samples);
    for (size_t i = 0; i < count; ++i) {
        const auto after =
            std::upper_bound(functions.begin(), functions.end(), samples[i],
                             [](uintptr_t place, const Function& f) { return place < f.begin; });
        const bool is_own = after != functions.begin() && samples[i] < (after - 1)->end;
        const Part part =
            is_own ? part_of_function(readable((after - 1)->name)) : part_of_library(samples[i]);
        shares[size_t(part)] += 1.0 / double(count);
    }
    return shares;
}

double instructions_of(const std::function<void()>& work) {
    perf_event_attr wanted{};
    wanted.size = sizeof(wanted);
    wanted.type = PERF_TYPE_HARDWARE;
    wanted.config = PERF_COUNT_HW_INSTRUCTIONS;
    wanted.exclude_kernel = wanted.exclude_hv = 1;
    const int counter = int(syscall(SYS_perf_event_open, &wanted, 0, -1, -1, 0));
    uint64_t before = 0, after = 0;
    const bool is_counting =
        counter >= 0 && read(counter, &before, sizeof(before)) == sizeof(before);
    work();
    const bool is_counted = is_counting && read(counter, &after, sizeof(after)) == sizeof(after);
    if (counter >= 0) close(counter);
    return is_counted ? double(after - before) : 0.0;
}

}  // namespace velatura::bench
