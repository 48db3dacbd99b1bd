"""
Renderers that umbra is measured against, each in an interpreter of its own.

The scripts here import nothing of umbra's, for the peers' packages want other
versions of Python than umbra's; a scene comes to them as JSON::

    child.Peer  -- a line of JSON each way -->  serve.serve -> ogre, workbench
    here                                        there
"""
