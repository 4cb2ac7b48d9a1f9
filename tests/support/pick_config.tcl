# SPDX-License-Identifier: GPL-2.0-or-later
# Copies a configuration as LinuxCNC's configuration selector does: pick.tcl PICKCONFIG INI CONFIGS NCFILES -> path of the copy
package require msgcat
lassign $argv script inifile ::myconfigs_node ncfiles
namespace eval linuxcnc {}
set linuxcnc::NCFILES_DIR $ncfiles
# its procedures and settings, without its windows
set part {}
foreach line [split [read [open $script]] \n] {
    append part $line\n
    if {[info complete $part]} {
        if {[regexp {^(proc |set ::)} $part]} {catch {eval $part}}
        set part {}
    }
}
proc tk_dialog {args} {return 0}
proc tk_messageBox {args} {puts stderr $args; exit 1}
proc verbose {args} {}
set ::configs_dir_list [list $::myconfigs_node [file dirname $inifile]]
puts [prompt_copy $inifile]
