# SPDX-License-Identifier: Apache-2.0
# Functions for scripts that test programs with a kernel of Debian in an emulated machine (QEMU, without KVM), which does
# not affect the kernel of this machine. This file must be sourced by a script that has defined `usage`. Before it calls
# run_tests, the script must also define:
#
#   kernel          package that depends on the newest kernel
#   kernel_files    patterns of the files of the kernel that are unpacked, besides the kernel itself
#   modules         modules that are loaded, in this order
#   build_programs  builds the programs
#   programs        paths of the programs, which are in the root of the machine
#   libraries       libraries that the programs load at run time, so that ldd does not list them
#   machine         options of QEMU
#   kernel_options  options of the kernel
#   commands        prints the shell commands of the machine. They write the results to /dev/ttyS1, one JSON object per
#                   line: {"test":"Name","passed":true,"took_ms":12,"figure":3,…}, and {"exit":0} if all tests passed
json=false
case "$#:${1-}" in
  0:) ;;
  1:--json) json=true ;;
  1:--help | 1:-h) usage && exit ;;
  *) usage >&2 && exit 2 ;;
esac

exec 3>&1 1>&2
. "$(dirname "${BASH_SOURCE[0]}")/steps.sh"
folder=$root/build/$(basename "$0" | sed 's/^test-//')
tree=$folder/tree
mkdir -p "$folder"

as_root() {
  if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi
}

get_packages() {
  local missing=() package
  for package in qemu-system-x86 busybox-static; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' $package 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  if ! as_root true 2>/dev/null; then
    echo "these packages are missing, and installing them requires root or sudo: ${missing[*]}"
    return 1
  fi
  as_root apt-get -qq update
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y -o Dpkg::Use-Pty=0 --no-install-recommends install "${missing[@]}"
}

# Downloads the newest kernel of this Debian release. Only a part of the 400 MB is unpacked.
get_kernel() {
  local package
  package=$(apt-cache depends "$kernel" | awk '$1 == "Depends:" { print $2; exit }')
  [ -n "$package" ] || { echo "apt-get does not find $kernel; run apt-get update"; return 1; }
  if [ "$(cat "$folder/package" 2>/dev/null)" != "$package" ]; then
    rm -rf "$folder/kernel" "$folder"/linux-image-*.deb
    mkdir "$folder/kernel"
    (cd "$folder" && apt-get -qq download "$package") ||
      { echo "cannot download $package; run apt-get update"; return 1; }
    dpkg-deb --fsys-tarfile "$folder"/linux-image-*.deb |
      tar -x -C "$folder/kernel" --wildcards './boot/vmlinuz-*' "${kernel_files[@]}"
    rm "$folder"/linux-image-*.deb
    echo "$package" >"$folder/package"
  fi
}

# build_targets TARGET…: builds targets of the preset release.
build_targets() {
  [ -f build/release/CMakeCache.txt ] || cmake --preset release
  cmake -DTENDON_TESTS=ON build/release
  cmake --build --preset release --target "$@" -j "$jobs"
}

# Adds the libraries of a program or library to the disk.
add_libraries() {
  local file
  ldd "$1" | grep -oE '/[^ ]+' | sort -u | while read -r file; do
    mkdir -p "$tree/${file%/*}"
    cp -L "$file" "$tree$file"
  done
}

# Creates the disk of the emulated machine, which contains busybox, the programs with their libraries, and the modules.
make_disk() {
  local program library module file
  rm -rf "$tree"
  mkdir -p "$tree"/{bin,dev,modules,proc,sys,tmp}
  cp "$(command -v busybox)" "$tree/bin/busybox"
  for program in "${programs[@]}"; do
    strip -o "$tree/${program##*/}" "$program"
    add_libraries "$program"
  done
  for library in "${libraries[@]}"; do
    file=$(/sbin/ldconfig -p | awk -v name="$library" '$1 == name && /x86-64/ && !found++ { print $NF }')
    [ -n "$file" ] || { echo "the library $library is missing; run deploy/setup test"; return 1; }
    mkdir -p "$tree/${file%/*}"
    cp -L "$file" "$tree$file"
    add_libraries "$file"
  done
  for module in "${modules[@]}"; do
    file=$(find "$folder/kernel" -name "$module.ko*" | head -1)
    [ -n "$file" ] || { echo "the kernel does not have the module $module"; return 1; }
    case $file in
      *.xz) xz -dc "$file" >"$tree/modules/$module.ko" ;;
      *) cp "$file" "$tree/modules/$module.ko" ;;
    esac
  done
  {
    echo '#!/bin/busybox sh'
    echo '/bin/busybox mount -t proc proc /proc'
    echo '/bin/busybox mount -t sysfs sysfs /sys'
    echo '/bin/busybox mount -t devtmpfs devtmpfs /dev'
    for module in "${modules[@]}"; do echo "/bin/busybox insmod /modules/$module.ko"; done
    commands
    echo '/bin/busybox poweroff -f'
  } >"$tree/init"
  chmod -R a+rX "$tree"
  chmod a+x "$tree/init"
  (cd "$tree" && find . | busybox cpio -o -H newc 2>/dev/null) | gzip -1 >"$folder/disk.gz"
}

run_machine() {
  rm -f "$folder/results" "$folder/console"
  timeout 600 qemu-system-x86_64 -accel tcg -smp 2 -m 512 -nodefaults -display none -no-reboot "${machine[@]}" \
    -kernel "$folder"/kernel/boot/vmlinuz-* -initrd "$folder/disk.gz" \
    -append "console=ttyS0 quiet panic=-1 ${kernel_options[*]}" \
    -serial "file:$folder/console" -serial "file:$folder/results"
  tr -d '\r' <"$folder/results" >"$folder/lines"
  cat "$folder/console" "$folder/lines"
  grep -qx '{"exit":0}' "$folder/lines"
}

# Runs all steps, and prints the results. Returns 1 if a test failed.
run_tests() {
  local passed=true commit whole started
  step "packages" get_packages
  step "kernel" get_kernel
  step "build" build_programs
  step "disk" make_disk
  rm -f "$folder/lines"
  started=$SECONDS
  (step "emulated machine" run_machine) || passed=false

  commit=$(git describe --always --dirty --exclude '*' 2>/dev/null || echo unknown)
  tests() { grep '"test"' "$folder/lines" 2>/dev/null || true; }
  whole="{\"passed\":$passed,\"tests\":$(tests | wc -l),\"kernel\":\"$(cat "$folder/package")\",\"commit\":\"$commit\",\"took_s\":$((SECONDS - started))}"
  if $json; then
    { tests; echo "$whole"; } >&3
  else
    # Print one line for each test and one for each value.
    tests | tr -d '{}"' | awk -F, '{
      split($1, name, ":"); split($2, passed, ":"); split($3, took, ":")
      printf "%-6s %s (%.1f s)\n", passed[2] == "true" ? "ok" : "FAILED", name[2], took[2] / 1000
      for (i = 4; i <= NF; ++i) { split($i, figure, ":"); printf "         %-40s %s\n", figure[1], figure[2] }
    }' >&3
    echo "$(tr -d '{}"' <<<"$whole" | sed 's/:/: /g; s/,/, /g')" >&3
  fi
  $passed
}
