# Completion of skillcrew, written by `skillcrew completion`. Nothing is run while you type but this.

@TABLES@

function _skillcrew_options
    _skillcrew_at "$argv[2]"
    for place in 2 3
        set -l word $place
        test (count $argv) -gt $place; and _skillcrew_at "$argv[2] $place "$argv[(math $place + 1)]
    end
end

function _skillcrew_files
    for name in "$argv[1]"*
        if test -d "$name"
            echo "$name/"
        else if test "$argv[2]" = @file
            echo "$name"
        end
    end
end

function _skillcrew
    set -l words (commandline -opc)
    set -l current (commandline -ct)
    set -l offered @flag
    if string match -q -- '--*' "$words[-1]"
        set offered (_skillcrew_value "$words[-1]")
    end
    if test "$offered" = @flag
        set offered
        if test (count $words) -eq 1
            set offered (_skillcrew_place commands)
        else if not string match -q -- '-*' "$current"
            set offered (_skillcrew_place "$words[2] "(count $words))
        end
        if test -z "$offered"
            set offered (_skillcrew_options $words)
        end
    end
    switch "$offered"
        case @folder @file
            _skillcrew_files "$current" "$offered"
        case '@list*'
            set -l begun (string match -r '.*,' -- "$current")
            printf '%s\n' "$begun"(string split -n ' ' -- (string replace @list '' -- "$offered"))
        case '*'
            set -l words (string split -n ' ' -- $offered)
            printf '%s\n' $words
            # What a user's own world is called may be a file.
            if test -n "$current"; and not string match -q -- '-*' "$current"
                string match -q -- "$current*" $words; or _skillcrew_files "$current" @file
            end
    end
end

complete -c skillcrew -f -a '(_skillcrew)'
