"""Page: the template, the style and the script that all HTML pages share, and the small pictures and colours in them.

A page is one file that needs no network. It opens from a disk as it does from a server, and follows the reader's choice of a
light or a dark screen.
"""
