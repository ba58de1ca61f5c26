# A bare Debian 12 in the temporary folder $root, which is removed when the script ends. For scripts that source this
# file, which runs them again in a mount namespace of their own. Needs root and debootstrap.
#
#     source "$(dirname "${BASH_SOURCE[0]}")/bare_debian.sh"
#     stage "bare Debian 12" make_system git,python3
#     stage "something" "${in_system[@]}" ls /

fail() {
    echo "scripts/$(basename "$0"): $1" >&2
    exit 1
}

[[ $(id -u) -eq 0 ]] || fail "only root can make a system to change its root to"
command -v debootstrap >/dev/null || fail "debootstrap is missing: apt-get install debootstrap"

# In a mount namespace of its own, so that no mount outlives the script, however it ends.
if [[ ${CASTOR_CHECK_UNSHARED:-} != yes ]]; then
    exec env CASTOR_CHECK_UNSHARED=yes unshare --mount --propagation private "$0" "$@"
fi

root=$(mktemp -d)
chmod 755 "$root"  # apt fetches as a user of its own
clean_up() {
    for folder in dev sys proc; do
        if mountpoint --quiet "$root/$folder"; then umount --recursive --lazy "$root/$folder"; fi
    done
    rm -rf --one-file-system "$root"
}
log=$(mktemp)
trap 'clean_up; rm -f "$log"' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# What runs a command in the system, which gets nothing of this environment but ways to the network.
in_system=(env --ignore-environment HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb LC_ALL=C.UTF-8
    "http_proxy=${http_proxy:-}" "https_proxy=${https_proxy:-}" "no_proxy=${no_proxy:-}" chroot "$root")

stage() {
    local name=$1 start=$SECONDS
    shift
    echo "== $name"
    "$@"
    echo "== $name: $((SECONDS - start)) s"
}

# Debian 12's own sources among those of this machine, as "URI SUITE COMPONENT"; none on another system.
host_sources() {
    apt-get indextargets --format '$(ORIGIN) $(CODENAME) $(REPO_URI) $(RELEASE) $(COMPONENT)' \
        'Created-By: Packages' 2>/dev/null |
        awk '$1 == "Debian" && $2 ~ /^bookworm/ && $5 == "main" {print $3, $4, $5}' | sort --unique
}

# What this machine's apt was told about reaching its sources.
host_apt_settings() {
    apt-config dump Acquire | grep -E '^Acquire::(https?|Check|Retries|ForceIPv)[^ ]* "[^"]' || true
}

# Makes the system in $root, with these packages, which have commas between them.
make_system() {
    local packages=$1 sources mirror
    sources=$(host_sources)
    [[ -n $sources ]] || sources="http://deb.debian.org/debian bookworm main"
    mirror=$(awk '$2 == "bookworm" {print $1; exit}' <<<"$sources")
    [[ -n $mirror ]] || fail "this machine's apt has no source of bookworm itself"
    # Debian's bootstrap reads the environment, not apt's settings.
    local http_proxy=${http_proxy:-}
    eval "$(apt-config shell http_proxy Acquire::http::Proxy)"
    http_proxy=$http_proxy \
        debootstrap --variant=minbase --include="$packages,ca-certificates" bookworm "$root" "$mirror" >"$log" 2>&1 ||
        { tail -n 20 "$log"; fail "debootstrap failed"; }
    sed 's/^/deb /' <<<"$sources" >"$root/etc/apt/sources.list"
    host_apt_settings >"$root/etc/apt/apt.conf.d/90host"
    cp /etc/hosts /etc/resolv.conf "$root/etc/"
    if [[ -d /usr/local/share/ca-certificates ]]; then
        cp --recursive /usr/local/share/ca-certificates "$root/usr/local/share/"
        chroot "$root" update-ca-certificates >/dev/null 2>&1
    fi
    mount --types proc proc "$root/proc"
    mount --rbind /sys "$root/sys"
    mount --rbind /dev "$root/dev"
}
