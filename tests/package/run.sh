#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs Debian packages in a fresh Debian 12, uses them there as an ordinary user, and removes them. ./dev package --check
# Usage: run.sh --needs     ends with what is missing, if this machine cannot do it
#        run.sh FILE.deb…   velatura, libvelatura-dev, and python3-velatura if it was built
# The new system is made in build/package/chroot, or $VELATURA_CHROOT, from the mirror that this machine installs from.
set -euo pipefail

die() {
    printf 'package check: %s\n' "$*" >&2
    exit 1
}

say() { printf -- '-- %s\n' "$*"; }

check_needs() {
    [[ $EUID -eq 0 ]] || die "needs root, to make a chroot; run it as root or with sudo"
    command -v debootstrap >/dev/null || die "needs debootstrap: apt-get install debootstrap"
    [[ -n $(mirror) ]] || die "finds no mirror of Debian bookworm in the sources of apt; run apt-get update"
}

mirror() {
    apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Origin: Debian' 'Codename: bookworm' 'Component: main' | head -n 1
}

check_needs
[[ ${1:-} == --needs ]] && exit
[[ $# -ge 1 ]] || die "expected .deb files"
deb= python_deb= development_deb=
for file in "$@"; do
    [[ -f $file ]] || die "$file: no such file"
    case $(basename "$file") in
        velatura_*.deb) deb=$(realpath "$file") ;;
        python3-velatura_*.deb) python_deb=$(realpath "$file") ;;
        libvelatura-dev_*.deb) development_deb=$(realpath "$file") ;;
        *) die "$file is neither velatura, libvelatura-dev nor python3-velatura" ;;
    esac
done
[[ -n $deb ]] || die "expected the package velatura"
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
root=${VELATURA_CHROOT:-$PWD/build/package/chroot}
log=${root%/}.log
start=$SECONDS
export LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive

leave() {
    local status=$?
    mountpoint -q "$root/proc" && umount "$root/proc"
    [[ $status -eq 0 ]] || echo "package check: FAILED; the system is left in $root, the log is $log" >&2
}
trap leave EXIT

as_root() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
# In /srv/artist, with nothing of this machine's environment
as_user() {
    chroot --userspec=artist:artist "$root" /usr/bin/env -i -C /srv/artist HOME=/srv/artist PATH=/usr/bin:/bin LC_ALL=C.UTF-8 "$@"
}

# renders NAME ARGUMENT…: exit code 0 and not one error or warning
renders() {
    local name=$1 said
    shift
    said=$(as_user velatura render "$@" --progress none -o "$name.exr" 2>&1) || die "rendering $name failed: $said"
    # Few samples may be told to be few
    said=$(grep -v '\[rare-light\]' <<<"$said") || true
    [[ $said != *error:* && $said != *warning:* ]] || die "rendering $name: $said"
    as_user velatura-comp verify -q "$name.exr"
    say "rendered $name"
}

say "a new Debian 12 in $root"
[[ ! -e $root ]] || { [[ -e $root/etc/debian_version ]] && rm -rf --one-file-system "$root"; } || die "$root is no Debian system"
debootstrap --variant=minbase bookworm "$root" "$(mirror)" >"$log" 2>&1 || die "debootstrap failed: $(tail -n 3 "$log")"
mount -t proc proc "$root/proc"
packages_before=$(as_root dpkg-query -W -f '${Package}\n' | sort)

say "installing $(basename "$deb") with its dependencies"
cp "$deb" "$root/tmp/"
as_root apt-get update -q >>"$log" 2>&1
as_root apt-get install -q -y --no-install-recommends "/tmp/$(basename "$deb")" >>"$log" 2>&1 || die "apt-get install failed: $(tail -n 5 "$log")"
mapfile -t listed < <(as_root dpkg -L velatura | grep -v '^/\.$')
as_root useradd --create-home --home-dir /srv/artist artist

for file in bin/velatura bin/velatura-comp share/man/man1/velatura.1.gz share/man/man1/velatura-render.1.gz share/man/man1/velatura-comp.1.gz \
    share/bash-completion/completions/velatura share/zsh/vendor-completions/_velatura \
    share/fish/vendor_completions.d/velatura.fish share/doc/velatura/copyright; do
    [[ -s $root/usr/$file ]] || die "/usr/$file is missing"
done
as_root bash -n /usr/share/bash-completion/completions/velatura
if readelf -S "$root/usr/bin/velatura" | grep -q '\.symtab'; then die "programs are not stripped"; fi
say "programs, man pages, completions and copyright are there"

# What scenes generate; the grids of bonfire need Debian's python3-openvdb
/usr/bin/python3 -B scenes/make.py sky bonfire >>"$log"
mkdir "$root/srv/artist/surface"
cp -r scenes/cornell scenes/sky scenes/bonfire "$root/srv/artist/"
cp tests/package/surface.usda "$root/srv/artist/surface/"
/usr/bin/python3 -B tests/package/make_image.py "$root/srv/artist/surface/image.hdr"
as_root chown -R artist:artist /srv/artist

small=(--res 64 48 --spp 4)
renders cornell cornell/cornell.usda "${small[@]}"
renders embree cornell/cornell.usda "${small[@]}" --accel embree
renders sky sky/sky.usda "${small[@]}"
renders surface surface/surface.usda "${small[@]}"
if [[ -f $root/srv/artist/bonfire/generated/bonfire.vdb ]]; then
    renders bonfire bonfire/bonfire.usda "${small[@]}"
else
    say "bonfire is skipped: python3-openvdb is not installed here"
fi
as_user velatura-comp mix sky.exr -o sky.png >/dev/null
as_user velatura-comp-ui --help >/dev/null
plan=$(as_user velatura plan surface/surface.usda)
for plugin in openimageio subdivision; do
    grep -q "^ loaded *$plugin " <<<"$plan" || die "velatura plan does not name $plugin: $plan"
done
sed -n '/^plugins/,/^memory/p' <<<"$plan" | sed '$d'

if [[ -n $python_deb ]]; then
    say "installing $(basename "$python_deb")"
    cp "$python_deb" "$root/tmp/"
    as_root apt-get install -q -y --no-install-recommends "/tmp/$(basename "$python_deb")" >>"$log" 2>&1 || die "apt-get install failed: $(tail -n 5 "$log")"
    mapfile -t -O "${#listed[@]}" listed < <(as_root dpkg -L python3-velatura | grep -v '^/\.$')
    cp tests/package/use_module.py "$root/srv/artist/"
    as_user python3 use_module.py || die "the Python module does not render what the program does"
    say "the Python module renders what the program does"
fi

if [[ -n $development_deb ]]; then
    say "installing $(basename "$development_deb") with its dependencies"
    cp "$development_deb" "$root/tmp/"
    # cmake recommends make, which is left out here
    as_root apt-get install -q -y --no-install-recommends make "/tmp/$(basename "$development_deb")" >>"$log" 2>&1 || die "apt-get install failed: $(tail -n 5 "$log")"
    mapfile -t -O "${#listed[@]}" listed < <(as_root dpkg -L libvelatura-dev | grep -v '^/\.$')
    cp -r examples "$root/srv/artist/"
    as_root chown -R artist:artist /srv/artist/examples
    as_user cmake -S examples -B built -DCMAKE_BUILD_TYPE=Release >>"$log" && as_user cmake --build built >>"$log" ||
        die "examples do not build against the installed package: $(tail -n 5 "$log")"
    as_user built/velatura_example_relight cornell/cornell.usda first.exr second.exr >>"$log" || die "the example does not render"
    for image in first second; do as_user velatura-comp verify -q $image.exr; done
    say "examples build against the installed package and render"
fi

size=$(as_root dpkg-query -W -f '${Installed-Size}' velatura)
added=$(comm -13 <(echo "$packages_before") <(as_root dpkg-query -W -f '${Package}\n' | sort) | wc -l)
say "removing it"
as_root apt-get remove -q -y velatura ${python_deb:+python3-velatura} ${development_deb:+libvelatura-dev} >>"$log" 2>&1
for file in "${listed[@]}"; do
    if [[ ! -d $root$file && -e $root$file ]]; then die "$file is left"; fi
done
left=$(find "$root/usr" "$root/etc" -iname '*velatura*')
[[ -z $left ]] || die "left: $left"

umount "$root/proc"
rm -rf --one-file-system "$root"
printf 'package check: passed in %d s; package %.1f MB, installed %.1f MB, %d files and folders, %d packages with dependencies\n' \
    $((SECONDS - start)) "$(stat -c %s "$deb" | awk '{print $1 / 1e6}')" "$(awk -v k="$size" 'BEGIN {print k * 1024 / 1e6}')" "${#listed[@]}" "$added"
