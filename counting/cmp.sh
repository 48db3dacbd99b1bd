cd /work/wt/counting
(PYTHONPATH=/work/wt/me/counting/base/src .venv/bin/python /work/wt/me/counting/few.py $1 $2 2>&1 | grep few)& (.venv/bin/python /work/wt/me/counting/few.py $1 $2 2>&1 | sed 's/^/NEW /' | tail -${3:-12}); wait; date; cat /proc/loadavg
