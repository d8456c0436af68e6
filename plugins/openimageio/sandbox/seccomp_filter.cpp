// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/seccomp_filter.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::plugins::openimageio {

namespace {

#if defined(__x86_64__)
constexpr uint32_t machine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr uint32_t machine = AUDIT_ARCH_AARCH64;
#else
constexpr uint32_t machine = 0;
#endif

constexpr uint32_t allow = SECCOMP_RET_ALLOW;
constexpr uint32_t reject = SECCOMP_RET_ERRNO | EPERM;
/// Libraries then make threads by the call whose flags can be seen.
constexpr uint32_t unknown_call = SECCOMP_RET_ERRNO | ENOSYS;

/// Whatever their arguments are.
constexpr int forbidden[] = {
    // Programs, processes, and a way round this filter
    SYS_execve,
    SYS_execveat,
    SYS_unshare,
    SYS_setns,
    SYS_io_uring_setup,
    // Other processes
    SYS_ptrace,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    SYS_kill,
    SYS_tkill,
    SYS_rt_sigqueueinfo,
    SYS_rt_tgsigqueueinfo,
    SYS_pidfd_open,
    SYS_pidfd_getfd,
    SYS_pidfd_send_signal,
    // Other machines
    SYS_socket,
    SYS_socketpair,
    SYS_connect,
    SYS_bind,
    SYS_listen,
    SYS_accept,
    SYS_accept4,
    // Names and rights of files
    SYS_unlinkat,
    SYS_renameat2,
    SYS_mkdirat,
    SYS_mknodat,
    SYS_linkat,
    SYS_symlinkat,
    SYS_fchmod,
    SYS_fchmodat,
    SYS_fchown,
    SYS_fchownat,
    SYS_truncate,
    SYS_ftruncate,
    SYS_utimensat,
    SYS_setxattr,
    SYS_lsetxattr,
    SYS_fsetxattr,
    SYS_openat2,
    // What only owners of a machine need
    SYS_setrlimit,
    SYS_mount,
    SYS_chroot,
    SYS_bpf,
    SYS_perf_event_open,
    SYS_userfaultfd,
    SYS_add_key,
    SYS_keyctl,
    SYS_request_key,
#if defined(__x86_64__)
    SYS_fork,
    SYS_vfork,
    SYS_unlink,
    SYS_rename,
    SYS_renameat,
    SYS_mkdir,
    SYS_rmdir,
    SYS_mknod,
    SYS_link,
    SYS_symlink,
    SYS_chmod,
    SYS_chown,
    SYS_lchown,
    SYS_creat,
#endif
};

class Filter {
  public:
    Filter() {
        load(offsetof(seccomp_data, arch));
        decide_unless_equal(machine, reject);
        load(offsetof(seccomp_data, nr));
#if defined(__x86_64__)
        // The same calls by other numbers
        add(BPF_JMP | BPF_JSET | BPF_K, 0x40000000, 0, 1);
        decide(reject);
#endif
        for (const int call : forbidden) decide_if_equal(uint32_t(call), reject);
        decide_if_equal(SYS_clone3, unknown_call);
    }

    /// Refuses the call where none of these bits is set in an argument.
    void require_bits(int call, int argument, uint32_t bits) {
        judge(call, argument, BPF_JSET, bits, true);
    }

    /// Refuses the call where one of these bits is set.
    void forbid_bits(int call, int argument, uint32_t bits) {
        judge(call, argument, BPF_JSET, bits, false);
    }

    /// Refuses the call where an argument, of 32 bits, is another.
    void require_value(int call, int argument, uint32_t value) {
        judge(call, argument, BPF_JEQ, value, true);
    }

    void use() {
        decide(allow);
        const sock_fprog program = {.len = static_cast<unsigned short>(steps_.size()),
                                    .filter = steps_.data()};
        // Where the system has none, the limits are what there is
        (void)::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program);
    }

  private:
    void add(int code, uint32_t value, int if_true = 0, int if_false = 0) {
        steps_.push_back({uint16_t(code), uint8_t(if_true), uint8_t(if_false), value});
    }

    void load(size_t offset) {
        add(BPF_LD | BPF_W | BPF_ABS, uint32_t(offset));
    }

    /// Refuses the call unless a test of an argument comes out as it is to.
    void judge(int call, int argument, int test, uint32_t value, bool is_to_hold) {
        add(BPF_JMP | BPF_JEQ | BPF_K, uint32_t(call), 0, 4);
        // Both machines have the low half first
        load(offsetof(seccomp_data, args) + sizeof(uint64_t) * size_t(argument));
        add(BPF_JMP | test | BPF_K, value, is_to_hold ? 1 : 0, is_to_hold ? 0 : 1);
        decide(reject);
        load(offsetof(seccomp_data, nr));
    }

    void decide(uint32_t result) {
        add(BPF_RET | BPF_K, result);
    }

    void decide_if_equal(uint32_t value, uint32_t result) {
        add(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 1);
        decide(result);
    }

    void decide_unless_equal(uint32_t value, uint32_t result) {
        add(BPF_JMP | BPF_JEQ | BPF_K, value, 1, 0);
        decide(result);
    }

    std::vector<sock_filter> steps_;
};

}  // namespace

void install_seccomp_filter() {
    if (machine == 0) return;
    constexpr uint32_t writing = O_WRONLY | O_RDWR | O_CREAT | O_TRUNC;
    Filter filter;
    filter.require_bits(SYS_clone, 0, CLONE_THREAD);
    filter.forbid_bits(SYS_openat, 2, writing);
#if defined(__x86_64__)
    filter.forbid_bits(SYS_open, 1, writing);
#endif
    // Aborting is a signal to oneself
    filter.require_value(SYS_tgkill, 0, uint32_t(::getpid()));
    // Limits may be asked for, not set
    filter.require_value(SYS_prlimit64, 2, 0);
    filter.use();
}

}  // namespace velatura::plugins::openimageio
