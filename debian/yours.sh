# Files that are the user's: debian/rules puts these functions into the maintainer scripts.
#
# Settings are conffiles in /etc/chipwise.  Everything else of the packages belongs to /usr, and still nobody's change is lost:
#   a file that was changed is copied to FILE.yours before dpkg replaces or removes it;
#   below $kept (samples, programs) it takes its place again, and the package's is FILE.new;
#   elsewhere (HAL files, programs of chipwise) the package's has to be the one that is used, and FILE.yours stays beside it.
kept="/usr/share/chipwise/configs /usr/share/chipwise/nc_files /usr/share/linuxcnc/aux_examples/chipwise*"

# The package's files that differ from what was installed, without conffiles.
changed() {
    dpkg --verify "$1" 2>/dev/null | sed -n 's/^..5......   *\(\/.*\)$/\1/p'
}

# An earlier FILE.yours that is not the same becomes FILE.yours.DATE.
copy_aside() {
    if [ -e "$1.yours" ] && ! cmp -s "$1" "$1.yours"; then mv -f -- "$1.yours" "$1.yours.$(date +%Y%m%d-%H%M%S)"; fi
    cp -p -- "$1" "$1.yours"
}

set_aside() {
    changed "$1" | while IFS= read -r path; do
        if [ -f "$path" ]; then copy_aside "$path"; fi
    done
}

# Files an earlier package has left; before the first installation, when dpkg would write over them.
set_left_aside() {
    find $kept -type f ! -name '*.yours*' ! -name '*.new' 2>/dev/null | while IFS= read -r path; do
        if ! dpkg -S "$path" >/dev/null 2>&1; then copy_aside "$path"; fi
    done
}

# give_back FOLDER..: FILE.yours is used again; where the package's FILE is gone, FILE.new goes, too.
give_back() {
    find "$@" -name '*.yours' -type f 2>/dev/null | while IFS= read -r path; do
        file=${path%.yours}
        if cmp -s "$path" "$file"; then
            rm -f -- "$path"
        elif [ -e "$file" ]; then
            mv -f -- "$file" "$file.new"
            mv -f -- "$path" "$file"
            echo "chipwise: $file is as you changed it; the one of this version is $file.new"
        else
            mv -f -- "$path" "$file"
            rm -f -- "$file.new"
        fi
    done
}

# name_changed FOLDER..: what was changed and is replaced.
name_changed() {
    find "$@" -name '*.yours' -type f 2>/dev/null | while IFS= read -r path; do
        if cmp -s "$path" "${path%.yours}"; then
            rm -f -- "$path"
        else
            echo "chipwise: ${path%.yours} is the one of this version; yours is $path"
        fi
    done
}

# name_left FOLDER..: after removal.
name_left() {
    find "$@" -type f 2>/dev/null | sort | while IFS= read -r path; do
        echo "chipwise: $path is yours and stays"
    done
}

# Configurations of users that do not start without chipwise.
name_users() {
    for ini in /root/linuxcnc/configs/*/*.ini /home/*/linuxcnc/configs/*/*.ini; do
        if [ -f "$ini" ] && grep -q '^[^#]*chipwise\|^#INCLUDE.*chipwise' "$ini" 2>/dev/null; then
            echo "chipwise: $ini uses chipwise; it stays, and LinuxCNC starts it again once chipwise's lines are taken out"
        fi
    done
}
